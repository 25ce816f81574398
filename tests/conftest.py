import fcntl
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from catalogue import SCENARIO, SCENARIOS
from few_pictures import drawn_once

os.environ.setdefault("NUMBA_NUM_THREADS", "1")
os.environ.setdefault("MPLBACKEND", "agg")


# Files of tests that take longest, first of all: whoever came to them last would be waited for.
LONGEST = (
    *("docs/test_commands.py", "pipeline/studies/test_stress_pieces.py", "faults/test_batch_faults.py"),
    *("solver/inflow/test_inflow_on_surface_clouds.py", "properties/test_erosion.py"),
    *("pipeline/test_torrent.py", "pipeline/batch/test_chosen.py", "properties/test_rough_surfaces.py"),
    *("pipeline/report/test_difference_chapter.py", "pipeline/emulation/test_emulate.py"),
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the longest files first."""
    order = {Path(__file__).parent / name: k for k, name in enumerate(LONGEST)}
    items.sort(key=lambda item: order.get(item.path, len(order)))


@pytest.fixture
def scenario_file(tmp_path: Path) -> Callable[..., Path]:
    """Write a small scenario, its bed friction swept over angles, with lines replaced or added."""

    def write(*angles: float, name: str = "box", replace: tuple[str, str] = ("", ""), more: str = "") -> Path:
        sweep = f"sweep: {{material.bed_friction: {list(angles)}}}\n" if angles else ""
        path = tmp_path / f"{name}.yaml"
        path.write_text(SCENARIO.format(name=name).replace(*replace) + sweep + more)
        return path

    return write


@pytest.fixture(scope="module")
def few_pictures() -> Iterator[None]:
    """Draw maps once a kind, for a module that does not look at them."""
    with drawn_once():
        yield


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """File that stub solvers note their runs in."""
    return tmp_path / "log"


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """Place for results."""
    return tmp_path / "results"


@dataclass(frozen=True)
class Shipped:
    """The shipped catalogue after one ``pipeline run``: the place, and what was shown."""

    out: Path
    shown: subprocess.CompletedProcess[str]


@pytest.fixture(scope="session")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Shipped:
    """Run every shipped scenario once, as a user does; processes of one session share what comes of it."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "catalogue"
    folder.mkdir(exist_ok=True)
    out, kept = folder / "results", folder / "shown.json"
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not kept.exists():
            command = [sys.executable, "-m", "pipeline", "run", *map(str, SCENARIOS), "--out", str(out)]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            kept.write_text(json.dumps([done.args, done.returncode, done.stdout, done.stderr]))
    return Shipped(out, subprocess.CompletedProcess(*json.loads(kept.read_text())))


@pytest.fixture(scope="session")
def cluster() -> Iterator[object]:
    """Two worker processes for the whole session."""
    from pipeline.batch.local_workers import workers

    with workers(2) as client:
        yield client


@pytest.fixture
def shared_workers(cluster: object, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let batches use the session's workers, of Dask, instead of starting their own."""

    @contextmanager
    def given(count: int) -> Iterator[object]:
        yield cluster

    monkeypatch.setattr("pipeline.batch.dask_pool.workers", given)
    monkeypatch.setattr("pipeline.batch.driver.FEW_RUNS", 0)
    monkeypatch.setattr("pipeline.batch.driver.LITTLE_WORK", -1.0)


@pytest.fixture(params=["forked", "dask"])
def any_workers(request: pytest.FixtureRequest) -> str:
    """Let batches use forked processes, then the session's workers; gives which."""
    if request.param == "dask":
        request.getfixturevalue("shared_workers")
    return request.param
