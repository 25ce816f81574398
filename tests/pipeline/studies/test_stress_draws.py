"""What is drawn apart: wider profile scenes, and scenes on elevation models; and the laws on surfaces."""

import numpy as np
import pytest

from pipeline.studies.stress.campaign import perform
from pipeline.studies.stress.repeats import larger
from pipeline.studies.stress.scenes import draw, prepared, read
from pipeline.studies.stress.shrink import shrink
from pipeline.studies.stress.watch import rates_of
from solver.checks.invariants import Laws
from solver.checks.states import state_of_run
from solver.checks.static_cells import Edges, neighbours_of
from solver.forms import begin
from solver.points.lattice import Lattice

SMALL = 1e5
DRAWN = [draw(1, k) for k in range(400)]
SURFACES = [each for each in DRAWN if each.labels["points"] == "surface"]
ON_CLOUDS = [each for each in DRAWN if each.labels["points"].startswith("surface, ")]
FED_CLOUDS = [each for each in ON_CLOUDS if "inflow" in each.data]


def wide(part):
    return [each for each in DRAWN if each.labels.get("drawn wider") == part]


def test_shares_are_drawn_wider_and_on_surfaces():
    drawn = SURFACES + ON_CLOUDS
    assert 0.05 < len(drawn) / len(DRAWN) < 0.15
    for part in ("table", "cliffs and walls", "earth pressure", "given depths"):
        assert len(wide(part)) >= 3
    grounds = " ".join(each.labels["profile"] for each in drawn)
    assert all(kind in grounds for kind in ("noise", "steps", "pits", "ridges", "gaps"))
    for some in (SURFACES, ON_CLOUDS):
        assert any("inflow" in each.data and "erodible_bed" in each.data for each in some)
    assert {"building", "dam", "basin"} <= {
        structure["kind"] for each in drawn for structure in each.data.get("structures", ())
    }
    assert any("zones" in each.data["material"] for each in drawn)


@pytest.mark.parametrize("drawn", [wide("table")[0], SURFACES[0], SURFACES[1]], ids=lambda drawn: drawn.name)
def test_what_a_scene_names_is_written_beside_it(drawn, tmp_path):
    again = read(drawn.write(tmp_path))
    assert again.files == drawn.files
    one, two = prepared(drawn).scene, prepared(again).scene
    np.testing.assert_array_equal(one.depth, two.depth)


def test_a_table_grows_with_its_scene():
    drawn = wide("table")[0]
    small, large = (prepared(each).scene for each in (drawn, larger(drawn)))
    x = np.linspace(*small.points.x, 50)
    np.testing.assert_allclose(
        large.profile.inclination(4 * x), small.profile.inclination(x), atol=1e-12, rtol=1e-9
    )


def test_a_scene_on_a_surface_is_shrunk_to_what_fails():
    drawn = next(each for each in SURFACES if "structures" in each.data and "erodible_bed" in each.data)
    small = shrink(drawn, lambda candidate: "erodible_bed" in candidate.data, 5.0)
    assert "structures" not in small.data
    assert small.data["points"]["spacing"] > drawn.data["points"]["spacing"]


def begun(drawn):
    ready = prepared(drawn)
    run = begin(ready.scene, float(ready.times[-1]), 0.0, True)
    state = state_of_run(run)
    return Laws(ready.scene, state, rates_of(run)), state


def test_the_laws_on_a_surface_see_what_breaks_them():
    drawn = next(e for e in SURFACES if e.labels["inflow"] == "none" and e.labels["structures"] == "none")
    laws, state = begun(drawn)

    def broken(**changes):
        return {check.law for check in laws.of_state(state._replace(**changes)) if not check.kept}

    assert broken() == set()
    wet = state.h > laws.dry
    assert "speed has a source" in broken(u=np.where(wet, 2 * laws.speed_limit(0.0), 0.0))
    assert "kinetic energy has a source" in broken(u=np.where(wet, 2 * laws.speed_limit(0.0), 0.0))
    assert "ledger of volume" in broken(h=state.h * (1 + 1e-10))
    assert "depth is not negative" in broken(h=state.h - 1e-20)


@pytest.mark.parametrize("drawn", SURFACES[:5] + FED_CLOUDS[:2], ids=lambda drawn: drawn.name)
def test_a_scene_on_a_surface_keeps_its_laws(drawn):
    row = perform(drawn, False, SMALL)
    assert not row.broken


def test_neighbours_on_a_lattice_are_those_of_its_pairs():
    rng = np.random.default_rng(3)
    lattice = Lattice((0, 12), (0, 7), 1.0)
    rows = neighbours_of(lattice)
    number = np.arange(np.prod(lattice.shape)).reshape(lattice.shape)
    left = np.concatenate([number[:, :-1].ravel(), number[:-1].ravel()])
    right = np.concatenate([number[:, 1:].ravel(), number[1:].ravel()])
    distance = np.repeat([lattice.dx, lattice.dy], [number[:, 1:].size, number[1:].size])
    edges, h = Edges(left, right, distance), rng.random(number.size)
    np.testing.assert_array_equal(rows.steepest(h), edges.steepest(h))
    np.testing.assert_array_equal(rows.largest(h), edges.largest(h))
    holds = h > 0.2
    np.testing.assert_array_equal(rows.held_around(holds), edges.held_around(holds))
    assert 0 < rows.held_around(holds).sum() < holds.sum()
