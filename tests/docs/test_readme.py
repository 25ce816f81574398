import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from root import ROOT
from typer.testing import CliRunner

from pipeline.cli.app import app
from pipeline.runs.runs import expand
from pipeline.scenario.scenario import Scenario, load
from pipeline.store.zarr_store import open_store

TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
PROMISES = (ROOT / "docs" / "promises.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", TEXT, flags=re.MULTILINE | re.DOTALL)


def snippet(containing: str) -> str:
    (found,) = [block for block in blocks("python") if containing in block]
    return found


def run(code: str) -> dict[str, object]:
    names: dict[str, object] = {}
    exec(compile(code, "README.md", "exec"), names)
    return names


def test_every_python_snippet_is_tested():
    assert len(blocks("python")) == 5


def test_the_gridded_snippet_gives_a_cloud_on_a_lattice(shipped, monkeypatch):
    monkeypatch.chdir(shipped.out.parent)
    names = run(snippet("to_lattice"))
    assert dict(names["grid"].depth.sizes) == {"run": 1, "time": 9, "y": 71, "x": 151}


def test_the_xarray_snippet_reads_the_shipped_sweep(shipped, monkeypatch, capsys):
    monkeypatch.chdir(shipped.out.parent)
    names = run(snippet("set_index"))
    assert names["done"].sizes["run"] == 4
    assert names["exceedance"].max() == 1
    assert names["runout"].shape == (2, 2)
    assert "bed_friction" in capsys.readouterr().out


def test_the_solver_snippet_gives_what_the_pipeline_stores(shipped, capsys):
    result = run(snippet("simulate"))["result"]
    assert abs(result.ledger.error) <= 1e-12
    with open_store(shipped.out / "chute.zarr") as stored:
        assert (stored["deposit_depth"][0] == result.deposit_depth.astype(np.float32)).all()
    assert "volume error" in capsys.readouterr().out


def test_the_scenario_holds(tmp_path):
    text, _, _ = blocks("yaml")
    path = tmp_path / "heap.yaml"
    path.write_text(text)
    (scenario,) = load([path])
    assert len(expand(scenario)) == 3
    assert not scenario.warnings


def test_the_scenario_on_an_elevation_model_holds(tmp_path):
    _, text, _ = blocks("yaml")
    scenario = on_torrent(tmp_path, text)
    assert len(expand(scenario)) == 1
    assert {receptor.name for receptor in scenario.settings.receptors} >= {"school", "farm"}


def test_the_inflow_and_the_section_hold_on_the_elevation_model(tmp_path):
    _, text, more = blocks("yaml")
    (tmp_path / "q.csv").write_text("time (s),discharge (m3/s)\n0,0\n20,60\n200,0\n")
    settings = on_torrent(tmp_path, text + more).settings
    assert [each.name for each in settings.inflow] == ["apex"]
    assert [each.name for each in settings.sections] == ["bridge"]


def on_torrent(folder: Path, text: str) -> Scenario:
    for name in ("terrain.tif", "releases.gpkg", "buildings.gpkg"):
        shutil.copy(ROOT / "scenarios" / "torrent" / name, folder)
    path = folder / "torrent.yaml"
    path.write_text(text)
    (scenario,) = load([path])
    return scenario


@pytest.mark.parametrize("command", re.findall(r"^\| `pipeline ([^`]+)`", TEXT, flags=re.MULTILINE))
def test_every_command_and_option_exists(command):
    name, *rest = command.split()
    shown = CliRunner().invoke(app, [name, "--help"], env={"COLUMNS": "200"}).stdout
    for option in re.findall(r"--[a-z-]+", " ".join(rest)):
        assert option in shown


@pytest.mark.parametrize("name", sorted(set(re.findall(r"`([\w/]+\.py::\w+)`", PROMISES))))
def test_every_promise_names_a_test(name):
    file, test = name.split("::")
    assert f"def {test}(" in (ROOT / "tests" / file).read_text(encoding="utf-8")


def test_every_option_of_a_run_is_described():
    shown = CliRunner().invoke(app, ["run", "--help"], env={"COLUMNS": "200"}).stdout
    assert set(re.findall(r"--[a-z-]+", shown)) - {"--help"} <= set(re.findall(r"--[a-z-]+", TEXT))


def test_every_link_leads_somewhere():
    for target in re.findall(r"\]\(([^)#:]+)\)", TEXT):
        assert (ROOT / target).exists(), target
