"""Batches of stub runs for the tests of what a batch promises, and what is looked at afterwards."""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from rich.console import Console

from pipeline.batch.driver import complete
from pipeline.batch.interrupts import MESSAGE
from pipeline.scenario.scenario import load
from pipeline.store import zarr_store
from pipeline.store.place import held
from pipeline.store.variables import TIMINGS, Status

DRIVER = """
import sys
from functools import partial
from pathlib import Path
from rich.console import Console
from stub_solvers import gated
import pipeline.runs.template
from pipeline.store import lock_objects
from pipeline.batch import driver
from pipeline.store.storage import located
from pipeline.store.place import held
from pipeline.scenario.scenario import load

if __name__ == "__main__":
    file, out, log, free, group, workers = sys.argv[1:]
    if workers == "dask":
        driver.FEW_RUNS, driver.LITTLE_WORK = 0, -1.0
    pipeline.runs.template.group_size = lambda *_: int(group)
    lock_objects.BEAT_SECONDS = 0.2
    with held(located(out)):
        solve = partial(gated, log=log, free=float(free))
        outcome = driver.complete(load([file]), located(out), Console(), count=2, solve=solve)
    sys.exit(outcome.exit_code)
"""


def start_driver(
    file: Path, out: Path, log: Path, free: float, group: int = 1, workers: str = "dask"
) -> subprocess.Popen[str]:
    """Start a batch on two workers in a process group of its own; runs from ``free`` on wait at the gate."""
    return subprocess.Popen(
        [sys.executable, "-c", DRIVER, file, str(out), log, str(free), str(group), workers],
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), str(Path.cwd())])},
        start_new_session=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def open_gate(log: Path) -> None:
    """Let the runs go on that wait."""
    log.with_suffix(".gate").touch()


def interrupt(process: subprocess.Popen[str]) -> str:
    """Interrupt a driver with all its processes; gives what it has shown, up to its being told."""
    os.killpg(process.pid, signal.SIGINT)
    shown = ""
    while MESSAGE not in shown:
        line = process.stdout.readline()
        assert line, shown
        shown += line
    return shown


def run(out: Path, *files: Path, solve: Callable[..., object], **options: object):
    """Do a batch in this process, with the workers it is given."""
    with held(out):
        return complete(load(files), out, Console(quiet=True), solve=solve, **options)


def computed(log: Path) -> Counter[float]:
    """Count how often each run was computed, by its bed friction."""
    return Counter(float(line) for line in log.read_text().split())


def counts(path: Path) -> Counter[Status]:
    """Count the runs of a store by what became of them."""
    return Counter(map(Status, zarr_store.statuses(path)))


def files(path: Path) -> dict[str, bytes]:
    """Give all that a store holds but its timings, by name of file."""
    if not isinstance(path, Path):
        held = path.fs.cat(path.fs.find(path.path))
        named = {name.partition(f"{path.name}/")[2]: data for name, data in held.items()}
        return {name: named[name] for name in sorted(named) if name.split("/")[0] not in TIMINGS}
    return {
        str(file.relative_to(path)): file.read_bytes()
        for file in sorted(path.rglob("*"))
        if file.is_file() and file.relative_to(path).parts[0] not in TIMINGS
    }


def until(condition: Callable[[], bool], seconds: float = 240) -> None:
    """Wait for a condition."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)
