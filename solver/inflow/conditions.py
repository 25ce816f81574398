"""How deep and how fast a discharge flows in: the table of depth and unit discharge of a section."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from solver.arrays import Array
from solver.inflow.hydrograph import Hydrograph
from solver.inflow.uniform_flow import DEPTHS, law_along, table_of
from solver.physics.friction import Friction
from solver.physics.resistance import Inertial

Line = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Inflow:
    """A hydrograph through a section, and one way to know depth or speed there.

    Parameters
    ----------
    name : str
        For messages.
    line : tuple of (x, y)
        Corners of the section, m. Flow goes down the bed through it, on level ground to the right hand of
        who walks along the line, on the boundary of the domain inward.
    hydrograph : Hydrograph
        Its discharge.
    depth : "normal" or float, optional
        The depth of uniform flow down the bed at the section, or the largest depth in it, m.
    froude, speed : float, optional
        In place of depth: the Froude number, or the speed, m s-1.
    zones : tuple of (Friction, float)
        Laws of friction of zones that the section crosses, which a normal depth rests on too, each with its
        share of the length.

    Raises
    ------
    ValueError
        If not exactly one of the three is given, or a number is not above 0.
    """

    name: str
    line: Line
    hydrograph: Hydrograph
    depth: Literal["normal"] | float | None = None
    froude: float | None = None
    speed: float | None = None
    zones: tuple[tuple[Friction, float], ...] = ()

    def __post_init__(self) -> None:
        given = [each for each in (self.depth, self.froude, self.speed) if each is not None]
        if len(given) != 1 or (given[0] != "normal" and not 0 < float(given[0]) < np.inf):
            raise ValueError(f"inflow {self.name}: expected one of depth, froude and speed, above 0")
        if len(self.line) < 2 or self.line[0] == self.line[-1]:
            raise ValueError(f"inflow {self.name}: expected a line of two or more corners")


@dataclass(frozen=True)
class Section:
    """A named line through which discharge is measured.

    Parameters
    ----------
    name : str
        For tables.
    line : tuple of (x, y)
        Its corners, m; the direction is that of an `Inflow`.
    """

    name: str
    line: Line


@dataclass(frozen=True)
class Rating:
    """Unit discharge by depth, tables of shape (n,): log of depth (m) and of discharge (m2 s-1).

    Parameters
    ----------
    fixed : float
        The largest depth of the section where it is given, m; 0 where the table says it.
    """

    log_depth: Array
    log_discharge: Array
    fixed: float = 0.0

    def depth(self, discharge: float) -> float:
        """Depth of a unit discharge (m2 s-1), m; beyond the table it goes on as a power."""
        return float(np.exp(_interpolated(self.log_discharge, self.log_depth, np.log(discharge))))

    def unit_discharge(self, depth: Array) -> Array:
        """Discharge per width at depths of any shape (m), m2 s-1."""
        wet = depth > 0
        at = np.log(np.where(wet, depth, 1.0))
        return np.where(wet, np.exp(_interpolated(self.log_depth, self.log_discharge, at)), 0.0)


def _interpolated(x: Array, y: Array, at: Array | float) -> Array:
    """Values of a table, linear between and beyond its entries."""
    i = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
    return np.asarray(y[i] + (at - x[i]) / (x[i + 1] - x[i]) * (y[i + 1] - y[i]))


def rating_of(inflow: Inflow, friction: Friction, along: float, normal: float, gravity: float) -> Rating:
    """Give depth and unit discharge at a section.

    Parameters
    ----------
    along, normal : float
        Gravity along the flow and normal to the bed at the section, m s-2.
    gravity : float
        m s-2.

    Raises
    ------
    ValueError
        If the normal depth is asked for, and there is none.
    """
    ends = np.array([DEPTHS[0], DEPTHS[-1]])
    if inflow.speed is not None:
        return Rating(np.log(ends), np.log(inflow.speed * ends))
    froude = 1.0 if inflow.froude is None else inflow.froude
    rating = Rating(np.log(ends), np.log(froude * np.sqrt(normal) * ends**1.5))
    if inflow.froude is not None:
        return rating
    if inflow.depth != "normal":
        assert inflow.depth is not None
        # what is known of the shares is that of the table
        return Rating(rating.log_depth, rating.log_discharge, float(inflow.depth))
    law = law_along(friction, gravity, inflow.zones)
    asked = f"expected froude or speed at inflow {inflow.name}"
    if law is None:
        raise ValueError(f"{asked}, as there is no normal depth with this law of friction")
    depths, speed = table_of(law, along, normal)
    if len(depths) < 2:
        slope = np.degrees(np.arctan2(along, normal))
        fast = isinstance(law, Inertial) and along > law.mu_1 * normal
        why = "no speed is enough for friction to balance gravity" if fast else "friction holds the flow"
        raise ValueError(
            f"{asked}, as the bed falls by {slope:.3g} degrees there, where {why} and there is no normal "
            "depth"
        )
    return Rating(np.log(depths), np.log(speed * depths))
