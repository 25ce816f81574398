"""The three forms of the method: which one a scene asks for, its operators and its run."""

from __future__ import annotations

from collections.abc import Hashable
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from solver.physics.elevation import Surface
from solver.points.cloud import PointCloud
from solver.points.lattice import Lattice
from solver.scene import Collocation, Scene, Scheme, WeightedResidual

if TYPE_CHECKING:
    from solver.cloud.operators import CloudOperators
    from solver.collocation.operators import CollocationOperators
    from solver.run import Run

Operators: TypeAlias = "CloudOperators | CollocationOperators"
Kind = Literal[
    "lattice",
    "cloud",
    "collocation",
    "surface",
    "cloud-on-surface",
    "lattice-with-buildings",
    "surface-with-buildings",
]


def kind_of(
    points: Lattice | PointCloud, scheme: Scheme, *, on_surface: bool = False, built: bool = False
) -> Kind:
    """Say which kind of run a scheme makes on points; ``built`` : whether there are buildings.

    On a cloud they take no kernels of their own.
    """
    if built and isinstance(points, Lattice):
        return "surface-with-buildings" if on_surface else "lattice-with-buildings"
    if on_surface:
        return "surface" if isinstance(points, Lattice) else "cloud-on-surface"
    if isinstance(scheme, Collocation):
        return "collocation"
    return "lattice" if isinstance(points, Lattice) else "cloud"


def key(points: Lattice | PointCloud, scheme: Scheme) -> Hashable:
    """Give what the operators of a scheme depend on beside the points; None where it needs none."""
    if isinstance(scheme, Collocation):
        return "collocation", scheme.support, scheme.degree, scheme.weight_shape, scheme.derivative
    if isinstance(points, Lattice):
        return None
    return scheme.support, scheme.degree, scheme.weight_shape


def prepare(
    points: Lattice | PointCloud, scheme: Scheme, buildings: NDArray[np.bool_] | None = None
) -> Operators | None:
    """Make the operators that `solver.scene.Scene` takes for runs that share points and scheme.

    Parameters
    ----------
    points : Lattice or PointCloud
        Points of the runs.
    scheme : WeightedResidual or Collocation
        Their scheme.
    buildings : array, optional
        Whether a cell is a building, of the shape of the points; on a lattice nothing depends on them.

    Returns
    -------
    Operators or None
        None where the scheme needs none.

    Raises
    ------
    ValueError
        If a support cannot carry the basis; the message names the points.
    """
    if isinstance(scheme, Collocation):
        from solver.collocation.operators import prepare_collocation

        return prepare_collocation(
            points, scheme.support, scheme.degree, scheme.weight_shape, scheme.derivative
        )
    if isinstance(points, Lattice):
        return None
    from solver.cloud.operators import prepare as prepare_cloud

    return prepare_cloud(points, scheme.support, scheme.degree, scheme.weight_shape, buildings)


def begin(scene: Scene, end: float, arrival_depth: float, skip: bool) -> Run:
    """Make the run that a scene's points and scheme ask for; what no run asks for is not loaded."""
    if scene.buildings is not None and not isinstance(scene.scheme, WeightedResidual):
        raise ValueError("buildings take the weighted-residual form")
    on_surface, built = isinstance(scene.terrain, Surface), scene.buildings is not None
    match kind_of(scene.points, scene.scheme, on_surface=on_surface, built=built):
        case "surface" | "surface-with-buildings":
            from solver.surface.run import SurfaceRun

            return SurfaceRun(scene, end, arrival_depth, whole=not skip)
        case "lattice" | "lattice-with-buildings":
            from solver.lattice.run import LatticeRun

            return LatticeRun(scene, end, arrival_depth, whole=not skip)
        case "cloud":
            from solver.cloud.run import CloudRun

            return CloudRun(scene, end, arrival_depth)
        case "cloud-on-surface":
            from solver.cloud.surface_run import SurfaceCloudRun

            return SurfaceCloudRun(scene, end, arrival_depth)
        case "collocation":
            from solver.collocation.run import CollocationRun

            return CollocationRun(scene, end, arrival_depth)
