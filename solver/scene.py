"""What a run is given: the scene, its boundaries and the numerical choices."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from solver.cloud_operators import CloudOperators
from solver.compiled import Array
from solver.lattice import Lattice
from solver.point_cloud import PointCloud
from solver.rheology import Coulomb, EarthPressure, Isotropic, Voellmy
from solver.terrain import Terrain

Side = Literal["open", "wall", "no-slip"] | float


@dataclass(frozen=True)
class Boundaries:
    """What stands at each side of the domain: a kind, or a given depth in m."""

    x_min: Side = "open"
    x_max: Side = "open"
    y_min: Side = "open"
    y_max: Side = "open"


@dataclass(frozen=True)
class WeightedResidual:
    """Numerical choices of the weighted-residual form.

    cfl : Courant number of the unsplit step, ``dt max((|u| + c_x)/dx + (|v| + c_y)/dy)``.
    wet_limit : depth up to which a cell counts as dry and does not move, part of the largest initial depth.
    rest_share : share of the released volume that may still move in a run that counts as at rest.
    support, degree, weight_shape : cells that a slope is taken from on a cloud, degree of the LMLS basis, and
    c of eq. 18; a lattice has its own four neighbours.
    """

    cfl: float = 0.9
    wet_limit: float = 1e-4
    rest_share: float = 1e-4
    support: int = 9
    degree: int = 1
    weight_shape: float = 4.0


@dataclass(frozen=True)
class Scene:
    """One run: where, what, and by which laws.

    points : a lattice of shape (ny, nx), or a cloud of shape (n,).
    depth, velocity_x, velocity_y : initial state, means over the cells, of the points' shape, m and m s-1.
    operators : from `solver.cloud_operators.prepare` for runs that share a cloud; by default a run on a cloud
    makes its own.
    """

    points: Lattice | PointCloud
    terrain: Terrain
    depth: Array
    velocity_x: Array
    velocity_y: Array
    friction: Coulomb | Voellmy
    earth_pressure: EarthPressure = field(default_factory=Isotropic)
    gravity: float = 9.81
    boundaries: Boundaries = field(default_factory=Boundaries)
    scheme: WeightedResidual = field(default_factory=WeightedResidual)
    operators: CloudOperators | None = None
