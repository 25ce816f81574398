"""The map of the page: its data against the store, and in a browser what hands do with it."""

import asyncio
import json
import re
import shutil

import numpy as np
import pytest
import xarray as xr
import zarr
from heaps import HEAP

import pipeline
from pipeline.assess.ensemble import ensemble
from pipeline.assess.probability import exceedance
from pipeline.hazard.map_files import ground
from pipeline.hazard.place_maps import of_place
from pipeline.report import explorer
from pipeline.report.explorer_ground import ground as ground_of
from pipeline.report.packing import unpacked
from pipeline.scenario.scenario import stored
from pipeline.store.variables import Status
from pipeline.store.zarr_store import open_store
from pipeline.studies.browser import installed, tab

pytestmark = pytest.mark.usefixtures("few_pictures")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    out = tmp_path_factory.mktemp("explorer") / "results"
    pipeline.run(HEAP, out, workers=1, quiet=True)
    return out


@pytest.fixture(scope="module")
def store(place):
    with open_store(place / "heap.zarr") as opened:
        yield opened.load()


@pytest.fixture(scope="module")
def found(place):
    return dict(of_place(place, {}))["heap"]


def data_of(store, found):
    settings = stored(store.attrs).hazard
    return json.loads(explorer.explorer(store, found, ground(found), settings))


@pytest.fixture(scope="module")
def data(store, found):
    return data_of(store, found)


def test_maxima_are_those_of_the_store(data, store):
    shape = store["max_depth"].shape
    for name in ("max_depth", "max_speed"):
        step, values = data["steps"][name], store[name].to_numpy().astype(np.float64)
        read = unpacked(data["fields"][name], shape) * step
        assert (read >= values - 1e-9).all()
        assert (read < values + step).all()
    arrival = unpacked(data["fields"]["arrival_time"], shape)
    np.testing.assert_array_equal(arrival == 0, store["arrival_time"].isnull())


def test_shares_above_thresholds_are_those_of_the_maps(data, store):
    runs = ensemble(store)
    counted = unpacked(data["fields"]["max_depth"], store["max_depth"].shape)
    weight = np.zeros(len(data["runs"]))
    for run in data["runs"]:
        weight[run["run"]] = run["weight"]
    assert 0.2 in data["thresholds"]["depth"]
    for threshold in data["thresholds"]["depth"]:
        number = round(threshold / data["steps"]["max_depth"])
        share = np.tensordot(weight, counted > number, 1)
        exact = exceedance(store["max_depth"], [threshold], runs, "threshold")[""][0]
        np.testing.assert_allclose(share, exact, atol=1e-9)


def test_frames_of_all_runs_are_there_where_there_is_room(data, store):
    assert data["frames"]["times"] == store["time"].to_numpy().tolist()
    assert set(data["frames"]["runs"]) == {"0", "1", "2", "3"}
    frames = unpacked(data["frames"]["runs"]["1"], store["depth"].shape[1:]) * data["steps"]["max_depth"]
    values = store["depth"][1].to_numpy().astype(np.float64)
    assert (frames >= values - 1e-9).all()
    assert (frames < values + data["steps"]["max_depth"] + 1e-9).all()


def test_frames_are_of_runs_spread_over_the_run_out_where_there_is_little_room(store, found, monkeypatch):
    one = len(data_of(store, found)["frames"]["runs"]["1"])
    monkeypatch.setattr(explorer, "FRAMES_BUDGET", round(1.8 * one))
    few = data_of(store, found)
    order = [run["run"] for run in few["runs"]]
    assert [int(run) for run in few["frames"]["runs"]] == [order[2]]


def test_a_large_map_is_made_of_blocks_that_hide_nothing(store, found, monkeypatch):
    whole = data_of(store, found)
    size = sum(map(len, whole["fields"].values()))
    monkeypatch.setattr(explorer, "MAXIMA_BUDGET", size // 2)
    coarse = data_of(store, found)
    block, shape = coarse["grid"]["block"], (4, coarse["grid"]["ny"], coarse["grid"]["nx"])
    assert block > 1
    assert sum(map(len, coarse["fields"].values())) <= size // 2
    values = unpacked(coarse["fields"]["max_depth"], shape)
    fine = unpacked(whole["fields"]["max_depth"], store["max_depth"].shape)
    assert values.max() == fine.max()
    arrival = unpacked(coarse["fields"]["arrival_time"], shape)
    first = unpacked(whole["fields"]["arrival_time"], store["max_depth"].shape)[:, :block, :block]
    held = np.where(first == 0, 65535, first).min(axis=(1, 2)) % 65535
    np.testing.assert_array_equal(arrival[:, 0, 0], held)


def test_contour_lines_lie_at_their_elevation(data, found):
    ground = data["ground"]
    assert ground["contours"]
    x, z = found["x"].to_numpy(), found["elevation"].to_numpy()
    for each in ground["contours"]:
        assert np.interp(each["line"][0], x, z) == pytest.approx(each["level"], abs=0.01)
        assert each["level"] % ground["interval"] == pytest.approx(0, abs=1e-9)


def test_contour_lines_of_a_surface_are_its_own():
    x, y = np.arange(0.0, 201, 4), np.arange(0.0, 121, 4)
    height = 0.1 * x + 0.05 * y[:, None]
    maps = xr.Dataset(coords={"x": x, "y": y, "elevation": (("y", "x"), height)})
    made = ground_of(maps, 1)
    levels = {each["level"] for each in made["contours"]}
    assert levels == set(np.arange(2.0, 26, 2))
    for each in made["contours"]:
        places = np.reshape(each["line"], (-1, 2))
        np.testing.assert_allclose(0.1 * places[:, 0] + 0.05 * places[:, 1], each["level"], atol=0.1)
    packed = unpacked(made["elevation"], height.shape) * made["step"] + made["low"]
    np.testing.assert_allclose(packed, height, atol=made["step"])


def test_runs_that_failed_or_were_cut_off_say_so(store, found):
    states = store["status"].copy(data=[Status.FAILED, Status.CUT_OFF, Status.DONE, Status.DONE])
    data = data_of(store.assign(status=states), found)
    runs = {run["run"]: run for run in data["runs"]}
    assert (runs[0]["computed"], runs[0]["status"]) == (False, "failed")
    assert (runs[1]["computed"], runs[1]["censored"]) == (True, True)


def test_there_is_none_without_the_fields_that_it_needs(store, found):
    settings = stored(store.attrs).hazard
    assert explorer.explorer(store.drop_vars("arrival_time"), found, None, settings) is None
    failed = store.assign(status=store["status"].copy(data=[Status.FAILED] * 4))
    assert explorer.explorer(failed, found, None, settings) is None


HANDS = """
(async () => {
  const root = document.querySelector(".explorer");
  const find = (role) => root.querySelector(`[data-role="${role}"]`);
  const wait = (time) => new Promise((done) => setTimeout(done, time)), seen = {};
  const map = find("map"), picture = () => map.toDataURL();
  const slide = async (role, value) => {
    find(role).value = value;
    find(role).dispatchEvent(new Event("input"));
    await wait(50);
  };
  const choose = async (role, value) => {
    find(role).value = value;
    find(role).dispatchEvent(new Event("change"));
    await wait(50);
  };
  const answers = () => Object.fromEntries(
    [...root.querySelectorAll("[data-answer]")].map((cell) => [cell.dataset.answer, cell.textContent]));
  seen.ready = root.dataset.ready;
  await slide("run", 1);
  await slide("time", 0);
  const first = picture();
  await slide("time", 3);
  seen.time_moves = picture() !== first;
  seen.time = find("time-words").textContent;
  // a click at a place of the lattice, by the page's own view of the map
  const one = explorers[0], place = one.onMap(PLACE);
  const [px, py] = one.toScreen(...place), box = map.getBoundingClientRect(), ratio = map.width / box.width;
  const at = { clientX: box.left + px / ratio, clientY: box.top + py / ratio, pointerId: 1, bubbles: true };
  map.dispatchEvent(new PointerEvent("pointerdown", at));
  map.dispatchEvent(new PointerEvent("pointerup", at));
  await wait(50);
  seen.run = answers();
  seen.words = find("answer").textContent;
  root.querySelector('[data-mode="all"]').click();
  await wait(50);
  await slide("threshold", THRESHOLD);
  const share = picture();
  seen.threshold = find("threshold-words").textContent;
  seen.all = answers();
  await slide("threshold", 0);
  seen.threshold_moves = picture() !== share;
  await slide("threshold", THRESHOLD);
  await choose("bound", "upper");
  seen.upper = find("legend").textContent;
  seen.bounds_shown = !find("bound-row").hidden;
  const cell = one.cell(...place).i;
  seen.shares = {};
  for (const bound of ["", "lower", "upper", "open"]) {
    await choose("bound", bound);
    seen.shares[bound] = one.shares()[cell];
  }
  await choose("bound", "");
  await slide("period", 1);
  seen.period = find("period-words").textContent;
  seen.period_moves = picture() !== share;
  seen.of_period = answers();
  const before = picture();
  find("in").click();
  seen.zooms = picture() !== before;
  map.dispatchEvent(new PointerEvent("pointerdown", at));
  map.dispatchEvent(new PointerEvent("pointermove", { ...at, clientX: at.clientX + 40 }));
  const moved = picture();
  map.dispatchEvent(new PointerEvent("pointerup", at));
  seen.pans = moved !== before;
  root.querySelector('[data-mode="run"]').click();
  await slide("time", 0);
  find("play").click();
  await wait(900);
  seen.plays = Number(find("time").value) > 0;
  find("play").click();
  const stopped = find("time").value;
  await wait(900);
  seen.pauses = find("time").value === stopped;
  const points = [...find("curve").querySelectorAll("circle")];
  points[points.length - 1].dispatchEvent(new MouseEvent("click"));
  await wait(100);
  seen.points = points.length;
  seen.farthest = find("run-words").textContent;
  await choose("run-quantity", "time");
  seen.legend = find("legend").textContent;
  seen.too_wide = document.documentElement.scrollWidth > innerWidth;
  return seen;
})()"""
X, Y, THRESHOLD = 60.0, 2.0, 0.2


async def seen_by_hands(page, hands, width, height):
    """Open a page in a tab of a size, and give what hands saw and what the page complained of."""
    async with tab() as shown:
        await shown.size(width, height)
        await shown.show(page)
        return await shown.script(hands), shown.said


@pytest.mark.skipif(installed() is None, reason="there is no headless browser (chromium)")
@pytest.mark.parametrize(("width", "height"), [(1280, 900), (390, 844)])
def test_in_a_browser_sliders_move_pictures_and_a_click_gives_what_the_store_has(
    place, store, found, data, tmp_path, width, height
):
    page = pipeline.write_report(place, tmp_path / "page.html")
    number = data["thresholds"]["depth"].index(THRESHOLD)
    hands = HANDS.replace("PLACE", f"{X}, {Y}").replace("THRESHOLD", str(number))
    seen, said = asyncio.run(seen_by_hands(page, hands, width, height))
    assert said == []
    assert seen["ready"] == "true"
    moves = ("time_moves", "threshold_moves", "period_moves", "zooms", "pans", "plays", "pauses")
    assert {name: seen[name] for name in moves} == dict.fromkeys(moves, True)
    assert not seen["too_wide"]
    # all runs are known: bounds are the share, and are not offered
    assert not seen["bounds_shown"]
    assert "upper bound" in seen["upper"]
    run = data["runs"][1]["run"]
    here = store.isel(run=run).sel(x=X, y=Y)
    assert first_number(seen["run"]["depth"]) == pytest.approx(float(here["max_depth"]), abs=0.011)
    assert first_number(seen["run"]["speed"]) == pytest.approx(float(here["max_speed"]), abs=0.11)
    assert first_number(seen["run"]["arrival"]) == pytest.approx(float(here["arrival_time"]), abs=1.01)
    frame = re.search(r"depth at (\d+) s([\d.]+) m", seen["words"])
    assert int(frame[1]) == store["time"][3] == first_number(seen["time"])
    assert float(frame[2]) == pytest.approx(float(here["depth"][3]), abs=0.011)
    assert seen["threshold"] == "0.2 m"
    share = float(found["depth_exceedance"].sel(depth_threshold=THRESHOLD, x=X, y=Y))
    assert first_number(seen["all"]["share-depth"]) == pytest.approx(share, abs=0.006)
    assert 0 < share < 1
    assert [seen["shares"][bound] for bound in ("", "lower", "upper")] == pytest.approx([share] * 3, abs=1e-6)
    assert seen["shares"]["open"] == 0
    assert seen["period"] == "30 years"
    deep = float(store["max_depth"].isel(run=3).sel(x=X, y=Y)) > THRESHOLD
    assert first_number(seen["of_period"]["share-depth"]) == deep
    assert seen["points"] == 4
    farthest = int(store["runout_distance"].to_numpy().argmax())
    assert seen["farthest"].startswith(f"run {farthest}: done")
    assert seen["legend"].startswith("time (s)")


@pytest.mark.skipif(installed() is None, reason="there is no headless browser (chromium)")
def test_in_a_browser_bounds_are_those_of_the_maps_where_runs_are_missing(place, tmp_path):
    """One run failed and one was cut off: what the page shows is what the maps say."""
    copied = tmp_path / "results"
    shutil.copytree(place, copied)
    held = zarr.open_group(copied / "heap.zarr", mode="r+")
    held["status"][:2] = [Status.FAILED, Status.CUT_OFF]
    found = dict(of_place(copied, {}))["heap"]
    with open_store(copied / "heap.zarr") as opened:
        index = data_of(opened, found)["thresholds"]["depth"].index(THRESHOLD)
    asked = """(async () => {
      const one = explorers[0], find = (role) => one.find(role), found = {};
      one.root.querySelector('[data-mode="all"]').click();
      find("threshold").value = NUMBER;
      for (const bound of ["", "lower", "upper"]) {
        find("bound").value = bound;
        found[bound] = [...one.shares()];
      }
      return [found, find("bound-row").hidden];
    })()""".replace("NUMBER", str(index))
    page = pipeline.write_report(copied, tmp_path / "page.html")
    (shares, hidden), said = asyncio.run(seen_by_hands(page, asked, 1280, 900))
    assert said == []
    assert not hidden
    for bound in ("", "lower", "upper"):
        name = f"depth_exceedance{'_' if bound else ''}{bound}"
        expected = found[name].sel(depth_threshold=THRESHOLD).to_numpy().ravel()
        np.testing.assert_allclose(shares[bound], expected, atol=1e-6)
    assert (np.array(shares["upper"]) > np.array(shares["lower"])).any()


@pytest.mark.skipif(installed() is None, reason="there is no headless browser (chromium)")
def test_in_a_browser_names_are_nearest_to_their_own_marks_and_none_is_of_what_is_out_of_view(
    place, tmp_path
):
    asked = """(async () => {
      const one = explorers[0], whole = one.named, marks = one.data.receptors.map((r) => one.seen(r, 1));
      const view = [one.canvas.width, one.canvas.height];
      one.view.e += 5000;
      one.draw();
      return [whole, marks, view, one.named.length];
    })()"""
    page = pipeline.write_report(place, tmp_path / "page.html")
    (names, marks, view, away), said = asyncio.run(seen_by_hands(page, asked, 1280, 900))
    assert said == []
    assert [each["name"] for each in names] == ["Häusli", "road"]
    for i, each in enumerate(names):
        left, top, wide, high = each["box"]
        assert left >= 0 <= top
        assert left + wide <= view[0]
        assert top + high <= view[1]
        own, other = (
            np.hypot(*(places - np.clip(places, [left, top], [left + wide, top + high])).T).min()
            for places in (np.array(marks[i]), np.array(marks[1 - i]))
        )
        assert each["isLed"] or own < other
    assert away == 0


def first_number(text):
    return float(re.search(r"[\d.]+", text)[0])


def test_a_page_of_many_runs_stays_small():
    """A map of 300 x 150 cells with 200 runs: what the page holds of it, from fields as rough as a flow's."""
    x, y = np.meshgrid(np.arange(300.0), np.arange(150.0) - 75)
    random = np.random.default_rng(1)
    total = {}
    fields = {name: [] for name in explorer.FIELDS}
    for _ in range(200):
        reach, width = random.uniform(150, 280), random.uniform(20, 45)
        inside = (x < reach) & (np.abs(y) < width * (0.4 + 0.6 * x / 300))
        rough = 1 + 0.05 * random.standard_normal(x.shape)
        depth = np.where(inside, 2.0 * (1 - (y / width) ** 2).clip(0.05) * rough, 0).clip(0)
        fields["max_depth"].append(explorer.rounded_up(depth, 0.01))
        fields["max_speed"].append(explorer.rounded_up(8 * depth * rough, 0.1))
        fields["arrival_time"].append(explorer.times(np.where(inside, x / 6 + np.abs(y) / 9, np.nan), 1.0))
    whole = {name: np.stack(held) for name, held in fields.items()}
    block, total = explorer._within_budget(whole)
    assert block <= 2
    assert sum(map(len, total.values())) + explorer.FRAMES_BUDGET < 7_000_000
