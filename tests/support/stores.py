"""Stores of scenarios run in this process."""

from __future__ import annotations

from pipeline.batch.task import Job, perform
from pipeline.runs.runs import expand, share
from pipeline.runs.template import template, variables
from pipeline.scenario.scenario import load
from pipeline.store import layout
from pipeline.store.zarr_store import open_store

TIME = "time: {end: 1, output_every: 0.5}"
SHORT = "time: {end: 0.2, output_every: 0.1}"
POINTS = "points: {layout: lattice, spacing: 0.5}"
SCATTERED = "points: {layout: poisson-disc, count: 900, seed: 5}"


def store_of(file, out):
    """Run a scenario in this process and open its store."""
    file.write_text(file.read_text().replace(TIME, SHORT))
    scenario = load([file])[0]
    runs = expand(scenario)
    shared = share(scenario, runs)
    path = out / f"{scenario.name}.zarr"
    layout.create(path, template(scenario, runs, shared))
    for run in runs:
        perform(Job(path, variables(scenario), (run,), shared))
    return open_store(path)
