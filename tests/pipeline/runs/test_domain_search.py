import numpy as np
import pytest
import xarray as xr
from batches import run
from commands import pipeline

from pipeline.mistakes import BadInput
from pipeline.scenario.scenario import load
from pipeline.store.variables import Status
from solver.simulation import simulate

CHUTE = """\
name: chute
gravity: 1.0
terrain: {{profile: bend, angle: 35, start: 17.5, end: 21.5}}
{domain}
points: {points}
release: {{shape: hemisphere, centre: [4, 0], radius: 1.85}}
material: {{internal_friction: 35, bed_friction: 30}}
time: {{end: 12, output_every: 4}}
sweep: {{release.centre.0: [3.2, 4.8]}}
"""


@pytest.fixture
def chute(tmp_path, shared_workers):
    """Run the chute with or without a domain, and give its store."""

    def do(name, domain="", points="{spacing: 0.4}"):
        file = tmp_path / f"{name}.yaml"
        file.write_text(CHUTE.format(domain=domain, points=points))
        assert run(tmp_path / name, file, solve=simulate).exit_code == 0
        return xr.open_zarr(tmp_path / name / "chute.zarr", consolidated=False).load()

    return do


def test_a_domain_that_was_found_holds_the_flow_and_changes_nothing(chute):
    found = chute("found")
    given = chute("given", "domain: {x: [-6, 36], y: [-12, 12]}")
    assert (found["status"] == Status.CUT_OFF).all()
    assert found.sizes["x"] < given.sizes["x"]
    assert found.sizes["y"] < given.sizes["y"]
    # points are multiples of the spacing in both
    same = given.sel(x=found["x"], y=found["y"], method="nearest")
    np.testing.assert_allclose(same["x"], found["x"], atol=1e-12)
    np.testing.assert_allclose(found["depth"], same["depth"], atol=1e-6)
    assert float(given["depth"].sum()) == pytest.approx(float(found["depth"].sum()), rel=1e-6)


def test_a_cloud_gets_a_domain_too(chute):
    cloud = chute("cloud", points="{layout: poisson-disc, spacing: 0.5}")
    assert (cloud["status"] == Status.CUT_OFF).all()
    assert float(cloud["area"].sum()) < 42 * 24


def test_what_is_left_is_done_on_the_domain_of_the_store(chute, tmp_path, monkeypatch):
    first = chute("again")
    monkeypatch.setattr("pipeline.runs.domain_search.MARGIN", 1.0)
    again = chute("again")
    assert again.sizes == first.sizes
    assert pipeline("verify", tmp_path / "again").exit_code == 0


def test_a_flow_that_does_not_end_asks_for_a_domain(tmp_path, shared_workers, monkeypatch):
    file = tmp_path / "plane.yaml"
    text = CHUTE.format(domain="", points="{spacing: 0.4}").replace("profile: bend", "profile: plane")
    file.write_text(text.replace(", start: 17.5, end: 21.5", "").replace("end: 12", "end: 120"))
    monkeypatch.setattr("pipeline.runs.domain_search.MOST_POINTS", 20_000)
    with pytest.raises(BadInput, match=r"domain: expected a domain, as the flow of run 0 goes on beyond x"):
        run(tmp_path / "out", file, solve=simulate)
    assert not list((tmp_path / "out").glob("*.zarr"))
    assert load([file])
