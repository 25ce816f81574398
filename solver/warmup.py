"""Kernels compiled, or loaded, before any run."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, get_args

import numpy as np

from solver.compiled import is_compiled
from solver.forms import Kind, begin
from solver.physics.elevation import ElevationModel
from solver.physics.friction import Coulomb
from solver.physics.terrain import Plane
from solver.points.cloud import random_points
from solver.points.lattice import Lattice
from solver.scene import Collocation, Scene, WeightedResidual
from solver.simulation import simulate

KINDS: tuple[Kind, ...] = get_args(Kind)


def not_compiled(kinds: Collection[Kind] = KINDS) -> list[Kind]:
    """List those kinds of runs whose kernels are not on disk yet."""
    return [kind for kind in kinds if not is_compiled(_last(kind))]


def _last(kind: Kind) -> Any:
    """Give the kernel of a kind of runs that is compiled last."""
    match kind:
        case "lattice" | "lattice-with-buildings":
            from solver.lattice import time_stepping

            built = kind.endswith("buildings")
            return time_stepping.advance_among_buildings if built else time_stepping.advance
        case "surface" | "surface-with-buildings":
            from solver.surface import time_stepping as surface_stepping

            built = kind.endswith("buildings")
            return surface_stepping.advance_among_buildings if built else surface_stepping.advance_surface
        case "cloud":
            from solver.cloud.time_stepping import advance_cloud

            return advance_cloud
        case "cloud-on-surface":
            from solver.cloud.time_stepping import advance_cloud_on_surface

            return advance_cloud_on_surface
        case "collocation":
            from solver.collocation.time_stepping import advance_collocation

            return advance_collocation


def compile_kernels(kinds: Collection[Kind] = KINDS, piece: int | None = None) -> None:
    """Compile the kernels of some kinds of runs, or load them: half a minute a kind once, then a second.

    Parameters
    ----------
    kinds : collection of Kind
        By default all.
    piece : int, optional
        One of `solver.run.PIECES` that different processes may compile at the same time.
    """
    for kind in kinds:
        cloudy = kind.startswith("cloud")
        points = random_points((0, 1), (0, 1), 60) if cloudy else Lattice((0, 1), (0, 1), 0.2)
        flat = np.zeros(points.shape)
        scheme = Collocation(support=9, degree=1) if kind == "collocation" else WeightedResidual()
        places = np.linspace(0.0, 1.0, 6)
        level = ElevationModel(places, places, np.zeros((6, 6)))
        bed = level if "surface" in kind else Plane(0.0)
        built = np.arange(flat.size).reshape(flat.shape) == flat.size // 2
        buildings = built if kind.endswith("buildings") else None
        scene = Scene(points, bed, flat, flat, flat, Coulomb(0.0), scheme=scheme, buildings=buildings)
        if piece is None:
            simulate(scene, [0.0])
        else:
            begin(scene, 0.0, 0.0, True).warm_up(piece)
