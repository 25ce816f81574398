"""What the pipeline costs beside the solver: ``python -m pipeline.studies.scale --runs 10000``."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import psutil
import typer

from pipeline.runs.runs import expand, share
from pipeline.runs.template import template
from pipeline.scenario.scenario import load
from pipeline.store.variables import COMPUTED
from pipeline.store.zarr_store import open_store

# The paper's chute, coarse: about 0.1 s a run.
SCENARIO = """\
name: scale
gravity: 1
terrain: {{profile: bend, angle: 35, start: 17.5, end: 21.5}}
domain: {{x: [0, 30], y: [-7, 7]}}
points: {{spacing: {spacing}}}
release: {{shape: hemisphere, centre: [4, 0], radius: 1.85}}
material: {{internal_friction: 38, bed_friction: 30}}
time: {{end: 24, output_every: 4}}
sweep:
  material.bed_friction: {angles}
  release.volume: {volumes}
"""
VOLUMES = 100
MEGABYTE = 1e6
SAMPLE_SECONDS = 1.0


def study(
    runs: Annotated[int, typer.Option(min=VOLUMES, help="Runs, in hundreds.")] = 10_000,
    workers: Annotated[int, typer.Option(min=1, help="Worker processes.")] = 1,
    spacing: Annotated[float, typer.Option(help="Spacing of the lattice.")] = 0.2,
) -> None:
    """Do a sweep of short runs as a user does, and a small part of it before, and print what they took."""
    with tempfile.TemporaryDirectory() as folder:
        # the first may compile the solver
        _measured(Path(folder, "first"), VOLUMES, workers, spacing)
        small = _measured(Path(folder, "small"), VOLUMES, workers, spacing)
        large = _measured(Path(folder, "large"), runs, workers, spacing)
    used, solver, elapsed = large.used, large.solver, large.elapsed
    more = runs - VOLUMES
    rows = {
        "runs done": f"{large.done} of {runs}, {large.group} a task",
        "workers": f"{workers}, on {os.cpu_count()} cores",
        "solver": f"{solver:.1f} s of CPU, {solver / runs:.4f} s a run, at most {large.longest:.4f} s",
        "pipeline": f"{used - solver:.1f} s of CPU, {100 * (used / solver - 1):.1f} % of the solver's",
        "elapsed": f"{elapsed:.1f} s, {100 * solver / elapsed / workers:.0f} % of it in the solver",
        "start": f"{large.start:.2f} s to check, expand and lay out",
        "opening": f"{large.opening:.3f} s",
        "driver": _course([driver for driver, _ in large.memory]),
        "largest worker": _course([worker for _, worker in large.memory]),
    }
    if more:
        further, solved = (used - small.used) / more, (solver - small.solver) / more
        once = used - solver - runs * (further - solved)
        rows["once"] = f"{once:.1f} s of the pipeline's CPU, by a batch of {VOLUMES} runs"
        rows["each run"] = (
            f"{1e3 * (further - solved):.1f} ms, {100 * (further / solved - 1):.1f} % of the solver's"
        )
    for name, what in rows.items():
        typer.echo(f"{name:15} {what}")


@dataclass(frozen=True)
class _Measured:
    """What a batch took: times in s, memory of driver and largest worker over time in MB."""

    done: int
    group: int
    start: float
    elapsed: float
    used: float
    solver: float
    longest: float
    opening: float
    memory: list[tuple[float, float]]


def _measured(folder: Path, runs: int, workers: int, spacing: float) -> _Measured:
    folder.mkdir()
    file, out = folder / "scale.yaml", folder / "results"
    angles = np.round(np.linspace(26, 34, runs // VOLUMES), 4).tolist()
    volumes = np.round(np.linspace(8, 16, VOLUMES), 4).tolist()
    file.write_text(SCENARIO.format(spacing=spacing, angles=angles, volumes=volumes))
    began = time.perf_counter()
    scenario = load([file])[0]
    listed = expand(scenario)
    group = template(scenario, listed, share(scenario, listed[:1])).group
    start = time.perf_counter() - began
    elapsed, used, memory = _batch(file, out, workers)
    began = time.perf_counter()
    with open_store(out / "scale.zarr") as store:
        opening = time.perf_counter() - began
        solver, longest = float(store["cpu_time"].sum()), float(store["cpu_time"].max())
        done = int(store["status"].isin(COMPUTED).sum())
    return _Measured(done, group, start, elapsed, used, solver, longest, opening, memory)


def _batch(file: Path, out: Path, workers: int) -> tuple[float, float, list[tuple[float, float]]]:
    """Do the batch; give elapsed and CPU time, s, and the memory of driver and largest worker over time."""
    before, began = _children_cpu(), time.perf_counter()
    given = ["run", str(file), "--out", str(out), "--workers", str(workers)]
    command = [sys.executable, "-m", "pipeline", *given]
    memory = []
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
        driver = psutil.Process(process.pid)
        while process.poll() is None:
            memory.append((_resident(driver), max(map(_resident, _workers(driver)), default=0.0)))
            time.sleep(SAMPLE_SECONDS)
    if process.returncode:
        raise typer.Exit(process.returncode)
    return time.perf_counter() - began, _children_cpu() - before, memory


def _children_cpu() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _workers(driver: psutil.Process) -> list[psutil.Process]:
    try:
        return list(driver.children())
    except psutil.Error:
        return []


def _resident(process: psutil.Process) -> float:
    try:
        return float(process.memory_info().rss) / MEGABYTE
    except psutil.Error:
        return 0.0


def _course(values: list[float]) -> str:
    """Say how memory went: in the middle of the first half of the time, of the second, and at most."""
    early, late = values[len(values) // 4], values[3 * len(values) // 4]
    return (
        f"{early:.0f} MB after a quarter of the time, {late:.0f} MB after three, {max(values):.0f} MB at most"
    )


if __name__ == "__main__":
    typer.run(study)
