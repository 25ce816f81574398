"""What a run is made by is found from imports: what decides it is covered, and what does not is left out."""

import subprocess
import sys
from functools import partial

import numpy as np
import pytest
from batches import computed, run
from commands import pipeline
from stub_solvers import by_friction

from pipeline.store import provenance, run_table, variables, zarr_store
from pipeline.store.variables import PER_RUN, Status
from solver import sources
from solver.sources import closure, modules_of

DECIDE = (
    "solver.simulation",
    "solver.lattice.residual",
    "solver.cloud.residual",
    "solver.collocation.residual",
    "solver.kernels.riemann",
    "solver.kernels.source_terms",
    "solver.physics.terrain_table",
    "solver.points.poisson_disc",
    "solver.release.shapes",
    "solver.compiled",
    "pipeline.runs.scene_of_run",
    "pipeline.runs.shared_points",
    "pipeline.scenario.solver_objects",
)
# packages and modules; an edit of any of them is no reason to compute a run again
DECIDE_NOTHING = (
    "solver.verification",
    "solver.checks",
    "solver.sources",
    "pipeline.assess",
    "pipeline.batch",
    "pipeline.cli",
    "pipeline.hazard",
    "pipeline.report",
    "pipeline.store",
    "pipeline.studies",
    "pipeline.runs.summary",
    "pipeline.runs.stored_values",
    "pipeline.runs.template",
    "pipeline.settings.hazard",
    "pipeline.settings.receptor",
    "pipeline.settings.sample",
    "pipeline.settings.settings",
)
LOADED = """
import sys
import pipeline.runs.scene_of_run, solver.forms, solver.simulation, solver.physics.terrain_table
print(*(name for name in sys.modules if name.partition(".")[0] in ("solver", "pipeline")))
"""


def test_what_decides_a_run_is_covered():
    assert set(DECIDE) <= provenance.computing()


def test_what_decides_no_run_is_left_out():
    covered = {
        name
        for name in provenance.computing()
        for other in DECIDE_NOTHING
        if name == other or name.startswith(f"{other}.")
    }
    assert covered == set()


def test_nothing_that_is_executed_for_a_run_is_missed():
    command = [sys.executable, "-c", LOADED]
    loaded = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    modules = modules_of("solver", "pipeline")
    packages = {name.removesuffix(".__init__") for name in modules if name.endswith(".__init__")}
    assert len(loaded) > 30
    assert set(loaded) - provenance.computing() - packages == {sources.__name__}


def test_summaries_have_a_hash_of_their_own():
    stored = provenance.storing()
    assert {"pipeline.runs.summary", "pipeline.runs.stored_values", "pipeline.store.variables"} <= stored
    assert "solver.checks.plausibility" in stored
    assert not stored & provenance.computing()
    assert provenance.solver_hash() != provenance.summary_hash()


def test_the_hash_is_that_of_the_code_covered(monkeypatch):
    modules = modules_of("solver", "pipeline")
    before = provenance.solver_hash(), provenance.summary_hash()

    def edited(name):
        changed = {**modules, name: sources.Module("edited", modules[name].imports)}
        monkeypatch.setattr(sources, "modules_of", lambda *packages: changed)
        return provenance.solver_hash() != before[0], provenance.summary_hash() != before[1]

    assert edited("solver.kernels.riemann") == (True, False)
    assert edited("pipeline.runs.scene_of_run") == (True, False)
    assert edited("pipeline.runs.summary") == (False, True)
    for name in ("pipeline.settings.hazard", "pipeline.studies.bench", "pipeline.store.run_table"):
        assert edited(name) == (False, False)


def test_a_module_that_cannot_be_followed_is_no_silent_gap():
    with pytest.raises(ImportError, match=r"solver\.nowhere"):
        closure(["solver.nowhere"], modules_of("solver"))


@pytest.fixture
def former(scenario_file, out, log, shared_workers, monkeypatch):
    """Give a store made before there was a deposit width, and by other summaries, with a run left."""
    with monkeypatch.context() as before:
        short = tuple(v for v in PER_RUN if v.name != "deposit_width")
        other = provenance.made_by() | {"summary_hash": "f" * 64}
        before.setattr(variables, "PER_RUN", short)
        before.setattr(provenance, "made_by", lambda: other)
        before.setattr("pipeline.runs.template.group_size", lambda *_: 1)
        run(out, scenario_file(20, 21), solve=partial(by_friction, log=log))
    (out / "box.zarr" / "status" / "c" / "1").unlink()
    return out / "box.zarr"


def test_a_store_without_a_newer_summary_is_told_of_and_taken(former, scenario_file, out, log):
    here = provenance.made_by()["summary_hash"]
    shown = pipeline("status", out).stdout.splitlines()[1]
    assert shown.endswith(f", summaries {'f' * 12}; summaries here: {here[:12]}")
    assert run(out, scenario_file(20, 21), solve=partial(by_friction, log=log)).exit_code == 0
    assert zarr_store.statuses(former).tolist() == [Status.DONE, Status.DONE]
    assert computed(log) == {20: 1, 21: 2}
    assert zarr_store.attributes(former)["summary_hash"] == f"{'f' * 64} {here}"
    assert pipeline("status", out).stdout.splitlines()[1].endswith(f"{'f' * 12} and {here[:12]}")
    assert pipeline("verify", out).exit_code == 0


def test_a_newer_summary_reads_as_missing(former, out):
    table = run_table.read(out)
    assert table["deposit_width"].isna().all()
    assert table["deposit_length"].notna().tolist() == [True, True]
    with zarr_store.open_store(former) as store:
        assert np.isnan(store["deposit_width"]).all()
        assert store["deposit_width"].attrs["units"] == "m"


def test_a_summary_that_is_known_no_more_stays_in_its_store(
    scenario_file, out, log, shared_workers, monkeypatch
):
    solve = partial(by_friction, log=log)
    monkeypatch.setattr("pipeline.runs.template.group_size", lambda *_: 1)
    run(out, scenario_file(20, 21), solve=solve)
    (out / "box.zarr" / "status" / "c" / "1").unlink()
    monkeypatch.setattr(variables, "PER_RUN", tuple(v for v in PER_RUN if v.name != "deposit_width"))
    assert run(out, scenario_file(20, 21), solve=solve).exit_code == 0
    assert pipeline("verify", out).exit_code == 0
    names = [variable.name for variable in zarr_store.held(out / "box.zarr", variables.kept())]
    assert names[-3:] == ["deposit_width", "digest", "status"]
    assert sorted(names) == sorted({*names})
