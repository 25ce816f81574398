"""A template of a store, and values for a run of it."""

from __future__ import annotations

import hashlib

import numpy as np

from pipeline.store.layout import Template
from pipeline.store.variables import COORDINATES, Variable, kept

NX, NY, NT = 5, 4, 3
CONTENT = "{}"
RUN = Variable("run", ("run",), "int64", "1", "position in the sweep", -1)


def template(runs: int = 5, group: int = 1, **sizes: int) -> Template:
    lengths = {"run": runs, "time": NT, "y": NY, "x": NX} | sizes
    return Template(
        variables=kept(),
        coordinates=(
            *((v, np.arange(lengths[v.dims[0]], dtype=float)) for v in COORDINATES),
            (RUN, np.arange(runs)),
        ),
        sizes=lengths,
        group=group,
        attributes={
            "title": "trial",
            "scenario_content": CONTENT,
            "scenario_hash": hashlib.sha256(CONTENT.encode()).hexdigest(),
        },
    )


def row(run: int) -> dict[str, object]:
    return {
        "depth": np.full((NT, NY, NX), run + 0.5),
        "max_depth": np.full((NY, NX), run + 1.0),
        "steps": 10 + run,
        "volume_out": 0.25,
        "wall_time": np.random.default_rng().random(),
    }
