"""What a run is given: the scene, its boundaries and the numerical choices."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, Protocol

from solver.arrays import Array
from solver.physics.earth_pressure import EarthPressure, Isotropic
from solver.physics.elevation import Surface
from solver.physics.friction import Coulomb, Voellmy
from solver.physics.terrain import Terrain
from solver.points.cloud import PointCloud
from solver.points.lattice import Lattice

DerivativeName = Literal["full", "diffuse"]
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
    weight_shape: float = 6.0


@dataclass(frozen=True)
class Collocation:
    """Numerical choices of the collocation form (eqs. 12-25). A part is one of the largest initial depth.

    support, degree, weight_shape : points of a support, degree of the LMLS basis, c of eq. 18.
    derivative : "full" (MLS), or "diffuse" as eq. 23 is printed (WLS).
    relaxation : omega of eq. 25; 0 relaxes nothing. threshold : of eq. 24. floor : least depth that eq. 24
    divides by, part.
    smoothing : "pairs" exchanges between pairs of points and makes no volume; "printed" replaces by eq. 25,
    to the letter with a relaxation of 1. smoothed : "all" of h, hu and hv, or "depth" alone.
    clip : set negative depths to zero, which makes volume.
    film : depth below which a point takes the mean velocity of the flow around it, part; 0 for none.
    cfl : Courant number, ``dt max((|u| + c_x) sum |D_x| + (|v| + c_y) sum |D_y|)``, D the derivative weights.
    wet_limit : depth up to which a point counts as dry and does not move, part.
    rest_share : share of the released volume that may still move in a run that counts as at rest.

    Raises
    ------
    ValueError
        If a choice is out of its range or unknown.
    """

    support: int = 49
    degree: int = 2
    weight_shape: float = 9.0
    derivative: DerivativeName = "full"
    relaxation: float = 0.5
    threshold: float = 0.02
    floor: float = 1e-3
    smoothing: Literal["pairs", "printed"] = "pairs"
    smoothed: Literal["all", "depth"] = "all"
    clip: bool = False
    film: float = 5e-3
    cfl: float = 0.7
    wet_limit: float = 1e-4
    rest_share: float = 1e-4

    def __post_init__(self) -> None:
        for name, known in (
            ("derivative", ("full", "diffuse")),
            ("smoothing", ("pairs", "printed")),
            ("smoothed", ("all", "depth")),
        ):
            if getattr(self, name) not in known:
                raise ValueError(f"{name} must be one of {', '.join(known)}, not {getattr(self, name)!r}")
        if not 0 <= self.relaxation <= 1:
            raise ValueError(f"relaxation must be between 0 and 1, not {self.relaxation}")
        for name in ("threshold", "floor", "film"):
            if not getattr(self, name) >= 0:
                raise ValueError(f"{name} must not be negative, but it is {getattr(self, name)}")


Scheme = WeightedResidual | Collocation


class Operators(Protocol):
    """What all runs of a scheme on the same points share, made once by `solver.forms.prepare`.

    Its properties are the choices of the scheme that they were made by.
    """

    @property
    def support(self) -> int:
        """Points of a support."""
        ...

    @property
    def degree(self) -> int:
        """Degree of the LMLS basis."""
        ...

    @property
    def weight_shape(self) -> float:
        """Shape parameter c of the weight function (eq. 18), dimensionless."""
        ...


@dataclass(frozen=True)
class Scene:
    """One run: where, what, and by which laws.

    points : a lattice of shape (ny, nx), or a cloud of shape (n,).
    depth, velocity_x, velocity_y : initial state, means over the cells, of the points' shape, m and m s-1.
    operators : from `solver.forms.prepare` for runs that share points and choices; by default a run makes
    its own.
    """

    points: Lattice | PointCloud
    terrain: Terrain | Surface
    depth: Array
    velocity_x: Array
    velocity_y: Array
    friction: Coulomb | Voellmy
    earth_pressure: EarthPressure = field(default_factory=Isotropic)
    gravity: float = 9.81
    boundaries: Boundaries = field(default_factory=Boundaries)
    scheme: Scheme = field(default_factory=WeightedResidual)
    operators: Operators | None = None

    @property
    def profile(self) -> Terrain:
        """The bed as a slope profile.

        Raises
        ------
        ValueError
            If it is a surface, which only the lattice takes.
        """
        if isinstance(self.terrain, Surface):
            raise ValueError("only the weighted-residual form on a lattice takes a surface")
        return self.terrain
