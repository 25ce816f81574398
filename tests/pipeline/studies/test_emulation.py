import numpy as np
import pytest
from root import ROOT

import pipeline
from pipeline.studies import emulation

SPACING, COUNT, FEW = 16.0, 256, 64


@pytest.mark.slow
def test_few_emulated_runs_of_the_valley_are_nearer_to_many_than_their_share(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    pipeline.run(emulation.scenario(SPACING, COUNT), tmp_path, quiet=True)
    truth = emulation.Truth(tmp_path, SPACING)
    for start in (64, 128):
        rows = np.arange(start, start + FEW)
        found = list(emulation.errors(truth.runs(rows), truth, truth.depth(rows), "few"))
        assert [row["threshold"] for row in found] == [0.25, 0.5, 1.0]
        for row in found:
            assert row["rmse"] < 0.012
            assert row["rmse"] < 0.6 * row["rmse_of_share"]
            assert row["coverage"] >= 0.95
            assert row["interval"] < 0.5 * row["interval_of_sampling"]
