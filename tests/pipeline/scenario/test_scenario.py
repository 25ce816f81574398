import hashlib
import json
import subprocess
import sys

import numpy as np
import pytest
from pydantic import BaseModel, ValidationError
from root import ROOT

from pipeline.inputs.elevation_table import read
from pipeline.scenario import reference
from pipeline.scenario.scenario import json_schema, load
from pipeline.settings.settings import Settings
from pipeline.store.changes import differences
from solver.scene import Collocation, WeightedResidual

CATALOGUE = sorted(ROOT.glob("scenarios/*.yaml"))


@pytest.mark.parametrize("path", CATALOGUE, ids=lambda path: path.stem)
def test_every_shipped_scenario_is_named_as_its_file_and_loads_without_a_warning(path):
    (scenario,) = load([path])
    assert scenario.name == path.stem
    assert scenario.warnings == ()
    assert scenario.text == path.read_text()


def test_the_event_with_and_without_its_dam_loads_and_differs_in_the_dam_alone():
    names = ("event-without-dam", "event-with-dam")
    without, dammed = load([ROOT / "scenarios/torrent" / f"{name}.yaml" for name in names])
    assert (without.name, dammed.name) == names
    for scenario in (without, dammed):
        # of houses on 6 m
        assert all("the flow passes through" in line for line in scenario.warnings)
    assert [each.kind for each in dammed.settings.structures] == ["building", "dam"]
    # what `pipeline compare` asks of the two
    same = ("points", "inflow", "material", "erodible_bed", "output", "time", "sweep", "return_periods")
    for name in (*same, "hazard", "receptors"):
        assert getattr(without.settings, name) == getattr(dammed.settings, name)
    changed = {"structures": without.settings.structures}
    assert dammed.settings.model_copy(update=changed).structures == dammed.settings.structures[:1]


def test_the_shipped_chute_stands_as_printed_and_as_meant():
    meant, printed = (
        s.settings for s in load([ROOT / "scenarios/chute.yaml", ROOT / "scenarios/chute-printed.yaml"])
    )
    assert (meant.terrain.transition, meant.terrain.curvature) == ("linear", True)
    assert (printed.terrain.transition, printed.terrain.curvature) == ("quadratic", False)
    assert meant.model_dump(exclude={"name", "description", "terrain"}) == printed.model_dump(
        exclude={"name", "description", "terrain"}
    )


def test_defaults_are_filled_in(scenario_file):
    settings = load([scenario_file()])[0].settings
    assert settings.gravity == 9.81
    assert {side for _, side in settings.boundaries} == {"open"}
    assert settings.time.stop_at_rest is True
    assert settings.material.turbulent_friction is None
    assert settings.releases[0].velocity == (0.0, 0.0)


def test_the_defaults_of_the_scheme_are_those_of_the_solver(scenario_file):
    scheme = load([scenario_file()])[0].settings.scheme
    assert scheme.make() == WeightedResidual()
    scheme = load([scenario_file(name="other", more="scheme: {form: collocation}\n")])[0].settings.scheme
    assert scheme.make() == Collocation()


def test_settings_are_frozen(scenario_file):
    settings = load([scenario_file()])[0].settings
    with pytest.raises(ValidationError, match="frozen"):
        settings.gravity = 1.0


def test_the_digest_is_that_of_the_content_and_not_of_its_writing(scenario_file):
    plain = load([scenario_file()])[0]
    rewritten = load([scenario_file(replace=("a box on a plane", "'another text' # and a comment"))])[0]
    changed = load([scenario_file(replace=("height: 0.5", "height: 0.6"))])[0]
    assert plain.digest == hashlib.sha256(plain.content.encode()).hexdigest() == rewritten.digest
    assert plain.digest != changed.digest


def test_the_order_of_a_sweep_counts(scenario_file):
    sweeps = (
        "sweep: {gravity: [1, 2], terrain.angle: [3, 4]}\n",
        "sweep: {terrain.angle: [3, 4], gravity: [1, 2]}\n",
    )
    first, second = (load([scenario_file(more=sweep)])[0] for sweep in sweeps)
    assert first.digest != second.digest


def test_a_release_partly_outside_is_warned_of_with_the_volume_lost(scenario_file):
    path = scenario_file(replace=("x: [1, 3]", "x: [9.25, 11.25]"))
    (scenario,) = load([path])
    assert scenario.warnings == (f"{path}:6:10: release: 1 m3 (50 %) lie outside the domain and are lost",)


def test_only_the_runs_of_a_sweep_are_warned_of(scenario_file):
    inside = load([scenario_file(more="sweep: {release.x.1: [4, 5]}\n")])[0]
    outside = load([scenario_file(more="sweep: {release.x.1: [4, 11.25], release.volume: [1, 20]}\n")])[0]
    assert inside.warnings == ()
    assert len(outside.warnings) == 1
    assert "1.95 m3 (9.8 %) lie outside" in outside.warnings[0]


def test_a_table_is_found_beside_its_scenario_and_counts_for_the_digest(scenario_file, tmp_path):
    profile = "{profile: table, file: slope.csv, smoothing: 1}"
    path = scenario_file(replace=("{profile: plane, angle: 30}", profile))
    table = tmp_path / "slope.csv"
    table.write_text("distance,elevation\n0,10\n5,5\n\n20, 1e0\n")
    (first,) = load([path])
    np.testing.assert_array_equal(first.tables["slope.csv"].elevations, [10, 5, 1])
    assert first.warnings == ()
    table.write_text("distance,elevation\n0,10\n5,5\n20,2\n")
    (second,) = load([path])
    told = "tables.slope.csv: the content of slope.csv has changed"
    assert differences(first.content, second.content) == [told]


def test_a_domain_beyond_its_table_is_warned_of(scenario_file, tmp_path):
    path = scenario_file(
        replace=("{profile: plane, angle: 30}", "{profile: table, file: slope.csv, smoothing: 1}")
    )
    (tmp_path / "slope.csv").write_text("distance,elevation\n0,3\n4,0\n")
    assert load([path])[0].warnings == (
        f"{path}:3:33: terrain.file: the table covers x from 0 to 5 m; beyond, its end slopes go on",
    )


def test_ten_thousand_runs_are_checked_within_seconds(scenario_file):
    import time

    lists = f"release.volume: {list(range(1, 101))}, terrain.angle: {[a / 4 for a in range(100)]}"
    path = scenario_file(more=f"sweep: {{{lists}}}\n")
    start = time.process_time()
    load([path])
    assert time.process_time() - start < 8


def test_too_many_runs_are_refused_without_trying_them(scenario_file):
    lists = ", ".join(
        f"{key}: {list(range(1, 101))}" for key in ("gravity", "release.volume", "release.height")
    )
    with pytest.raises(Exception, match="expected at most 100,000 runs, found 1,000,000"):
        load([scenario_file(more=f"sweep: {{{lists}}}\n")])


def test_the_schema_describes_every_key():
    schema = json_schema()
    assert set(schema["required"]) == {"name", "terrain", "points", "material"}
    models = [schema, *(model for model in schema["$defs"].values() if "properties" in model)]
    assert all("description" in info for model in models for info in model["properties"].values())
    assert schema["$defs"]["Bend"]["properties"]["start"]["unit"] == "m"
    assert schema["$defs"]["Time"]["additionalProperties"] is False
    json.dumps(schema)


def test_the_reference_of_keys_is_current():
    assert (ROOT / "docs/scenario.md").read_text() == reference.markdown()


def test_the_reference_lists_every_key_of_every_section():
    def keys(model: type[BaseModel]) -> int:
        return len(model.model_fields)

    # a section that has two places, as a rectangle, stands at both
    models = [model for loc, model in reference.sections() if reference._title(loc, model) is not None]
    rows = [line for line in reference.markdown().splitlines() if line.startswith("| `")]
    assert len(rows) == sum(map(keys, models))
    assert Settings in models


def test_checking_scenarios_imports_nothing_heavy():
    code = (
        "import sys; from pipeline.scenario.scenario import load; from pipeline.runs.runs import expand; "
        f"runs = expand(load([{str(ROOT / 'scenarios/chute-sweep.yaml')!r}])[0]); "
        "print(len(runs), {'numba', 'xarray', 'dask', 'scipy', 'zarr', 'pandas'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout == "4 set()\n"


def test_a_table_is_read_with_its_digest(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("d,z\n0,1\n2,0.5\n")
    table = read(path)
    np.testing.assert_array_equal(table.distances, [0, 2])
    np.testing.assert_array_equal(table.elevations, [1, 0.5])
    assert table.digest == hashlib.sha256(np.array([[0, 1], [2, 0.5]]).tobytes()).hexdigest()
