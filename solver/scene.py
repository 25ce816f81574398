"""What a run is given: the scene, its boundaries and the numerical choices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array
from solver.inflow.conditions import Inflow, Section
from solver.physics.constants import GRAVITY
from solver.physics.earth_pressure import EarthPressure, Isotropic
from solver.physics.elevation import Surface
from solver.physics.erosion import ErodibleBed
from solver.physics.friction import Friction
from solver.physics.terrain import Terrain
from solver.points.cloud import PointCloud
from solver.points.lattice import Lattice
from solver.scheme import Collocation, Scheme, WeightedResidual

__all__ = [
    "Boundaries",
    "Collocation",
    "Inflow",
    "Scene",
    "Scheme",
    "Section",
    "Side",
    "WeightedResidual",
]

Side = Literal["open", "wall", "no-slip"] | float


@dataclass(frozen=True)
class Boundaries:
    """What stands at each side of the domain.

    Parameters
    ----------
    x_min, x_max, y_min, y_max : {"open", "wall", "no-slip"} or float
        Kind of the side, or the depth that is given there, m.
    """

    x_min: Side = "open"
    x_max: Side = "open"
    y_min: Side = "open"
    y_max: Side = "open"


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
class Zone:
    """A part of the domain with a law of friction of its own.

    Parameters
    ----------
    friction : Friction
        Of the same class as that of the scene.
    share : array
        Of the area of each cell that is in the zone, 0 to 1, of the shape of the points.
    """

    friction: Friction
    share: Array


@dataclass(frozen=True)
class Scene:
    """One run: where, what, and by which laws.

    Parameters
    ----------
    points : Lattice or PointCloud
        A lattice of shape (ny, nx), or a cloud of shape (n,).
    depth, velocity_x, velocity_y : array
        Initial state, means over the cells, of the points' shape, m and m s-1.
    terrain : Terrain or Surface
        Slope profile, or elevation model.
    friction : Friction
        Law of basal friction.
    earth_pressure : EarthPressure
        Law of earth pressure.
    gravity : float
        In m s-2.
    boundaries : Boundaries
        Sides of the domain.
    scheme : WeightedResidual or Collocation
        Form of the equations, with its numbers.
    erodible_bed : ErodibleBed, optional
        What the flow may take up, if anything.
    operators : Operators, optional
        From `solver.forms.prepare` for runs that share points and choices; by default a run makes its
        own.
    zones : tuple of Zone
        With a law of friction of their own, which do not overlap.
    buildings : array, optional
        Whether a cell is a building, which nothing flows through, of the shape of the points; None where
        there is none.
    inflows : tuple of Inflow
        Hydrographs through sections.
    sections : tuple of Section
        Where discharge is measured. Inflows and sections take the weighted-residual form.
    section_times : sequence of float
        Times of the samples of discharge, s, increasing.
    """

    points: Lattice | PointCloud
    terrain: Terrain | Surface
    depth: Array
    velocity_x: Array
    velocity_y: Array
    friction: Friction
    earth_pressure: EarthPressure = field(default_factory=Isotropic)
    gravity: float = GRAVITY
    boundaries: Boundaries = field(default_factory=Boundaries)
    scheme: Scheme = field(default_factory=WeightedResidual)
    operators: Operators | None = None
    erodible_bed: ErodibleBed | None = None
    zones: tuple[Zone, ...] = ()
    buildings: NDArray[np.bool_] | None = None
    inflows: tuple[Inflow, ...] = ()
    sections: tuple[Section, ...] = ()
    section_times: Sequence[float] | Array = ()

    @property
    def least_coefficient(self) -> float:
        """Least friction coefficient at any speed and depth, wherever it is, dimensionless."""
        return min(
            each.least_coefficient for each in (self.friction, *(zone.friction for zone in self.zones))
        )

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
