from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import xarray as xr
import yaml
from root import ROOT

from pipeline.studies.emulation import __main__ as command
from pipeline.studies.emulation import valley
from pipeline.studies.emulation.cases import CASES, VALLEY
from pipeline.studies.emulation.truth import Truth
from pipeline.studies.emulation.valley import errors

SPACING, COUNT, FEW = 16.0, 256, 64
SMALL = replace(
    VALLEY,
    name="small",
    truth={SPACING: COUNT},
    asked={"depth": [0.25, 0.5], "speed": [5], "pressure": [30]},
    arrival=(60.0,),
    few=(FEW,),
)
slow = pytest.mark.slow


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Runs and tables of the study, made as its command makes them."""
    folder = tmp_path_factory.mktemp("study")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(ROOT)
        patch.setitem(CASES, SMALL.name, SMALL)
        command.main(["--case", SMALL.name, "--runs", str(folder), "--to", str(folder / "tables")])
    return folder


def read(path):
    head, _, *rows = path.read_text().splitlines()
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in (head, *rows)]
    table = pd.DataFrame(cells[1:], columns=cells[0])
    return table.apply(lambda column: pd.to_numeric(column, errors="coerce").fillna(column))


@slow
def test_the_command_tables_every_threshold_of_a_case_and_how_verdicts_come_out(place):
    table = read(place / "tables" / "small.md").set_index(["what", "place"])
    depths = table.loc[(["depth above 0.25 m", "depth above 0.5 m"], "map"), :]
    assert len(depths) == 2
    assert (depths["rmse"] < depths["rmse_of_share"]).all()
    assert {"speed above 5 m s-1", "pressure above 30 kPa", "arrival before 60 s"} <= {
        what for what, _ in table.index
    }
    emulated = table[~table.index.get_level_values("what").str.startswith("arrival")]
    assert (emulated["coverage"] >= 0.9).all()
    verdicts = read(place / "tables" / "small-verdicts.md")
    supported = verdicts[verdicts["verdict"].eq("supported") & verdicts["quantity"].eq("all others")]
    assert (supported["coverage"] >= 0.95).all()
    assert (supported["rmse"] < supported["rmse_of_share"]).all()


@slow
def test_few_emulated_runs_of_the_valley_are_nearer_to_many_than_their_share(place):
    truth = Truth(place, SMALL.named(SPACING))
    for start in (64, 128):
        rows = np.arange(start, start + FEW)
        found = list(errors(truth.runs(rows), truth, truth.depth(rows), "few"))
        assert [row["threshold"] for row in found] == [0.25, 0.5, 1.0]
        for row in found:
            assert row["rmse"] < 0.012
            assert row["rmse"] < 0.6 * row["rmse_of_share"]
            assert row["coverage"] >= 0.95
            assert row["interval"] < 0.5 * row["interval_of_sampling"]


def test_the_shipped_valley_is_compared_with_the_runs_on_its_own_spacing(monkeypatch):
    class Runs:
        def __init__(self, spacing):
            self.spacing, self.store = spacing, xr.Dataset({"volume": ("run", np.arange(4096.0))})

        def runs(self, rows, *finer, failed=None):
            return self.spacing, rows

        def depth(self, rows):
            return rows

    said = []
    monkeypatch.setattr(
        valley, "errors", lambda runs, truth, plain, what, **_: said.append((what, runs, truth)) or ()
    )
    wide, close = Runs(8.0), Runs(4.0)
    assert list(valley.maps(wide, close, Runs(2.0))) == []
    rows = [(runs, truth) for what, runs, truth in said if what == "256 runs at 4 m"]
    assert {truth for _, truth in rows} == {close}
    assert [spacing for (spacing, _), _ in rows] == [4.0] * 4
    # blocks of all of them, none in two
    assert np.array_equal(np.concatenate([block for (_, block), _ in rows]), np.arange(1024))
    assert yaml.safe_load(VALLEY.file.read_text())["sample"]["count"] == valley.SHIPPED
