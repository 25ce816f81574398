"""Whatever becomes of a file, it gives runs or lines that say what is wrong with it and where."""

import random
import re
import shutil
import time
import warnings

import mutants
import pytest
from root import ROOT

from pipeline.mistakes import BadInput
from pipeline.runs.runs import expand
from pipeline.runs.size import size
from pipeline.scenario.scenario import load

SHIPPED = sorted((ROOT / "scenarios").rglob("*.yaml"))
TABLES = sorted((ROOT / "scenarios").rglob("*.csv"))
LINE = re.compile(r".+:[1-9]\d*:[1-9]\d*: \S.*")
# of the processor, of all tests here
MOST_SECONDS = 12.0
SEED = 20


def outcome(path):
    """Number of runs that a file makes, or the lines that refuse it."""
    with warnings.catch_warnings():
        # what NumPy warns of is on the terminal of a user
        warnings.simplefilter("error")
        try:
            # one of several levels is one scenario a level
            scenarios = load([path])
        except BadInput as error:
            lines = str(error).splitlines()
            assert lines
            assert all(LINE.fullmatch(line) for line in lines), lines
            return lines
        for scenario in scenarios:
            runs = expand(scenario)
            assert runs[len(runs) - 1].settings.domain == scenario.settings.domain
            assert str(size(scenario))
        return len(runs)


def test_every_mutant_of_a_shipped_scenario_makes_runs_or_is_refused_with_lines(tmp_path):
    rng, path = random.Random(SEED), tmp_path / "mutant.yaml"
    for table in TABLES:
        shutil.copy(table, tmp_path)
    texts = [file.read_text() for file in SHIPPED]
    counts, start = {int: 0, list: 0}, time.process_time()
    while sum(counts.values()) < 500 and time.process_time() - start < MOST_SECONDS / 2:
        text = mutants.of_scenario(rng.choice(texts), rng)
        path.write_text(text)
        try:
            counts[type(outcome(path))] += 1
        except Exception as error:
            pytest.fail(f"{type(error).__name__}: {error}\n{text}")
    assert min(counts.values()) > 10, counts


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.stem)
def test_every_mutant_of_a_shipped_table_makes_runs_or_is_refused_with_lines(tmp_path, table):
    rng, path = random.Random(SEED), tmp_path / "scenario.yaml"
    near = [file for file in SHIPPED if file.parent == table.parent]
    naming = next(file for file in near if table.name in file.read_text())
    path.write_text(naming.read_text())
    counts, start = {int: 0, list: 0}, time.process_time()
    while sum(counts.values()) < 60 and time.process_time() - start < MOST_SECONDS / 6:
        text = mutants.of_table(table.read_text(), rng)
        (tmp_path / table.name).write_text(text)
        try:
            counts[type(outcome(path))] += 1
        except Exception as error:
            pytest.fail(f"{type(error).__name__}: {error}\n{text}")
    assert min(counts.values()) > 2, counts
