"""Uniform flows on a slope that erode their bed: what the equations give, and what runs give by time step.

``python -m solver.verification.erosion_cases`` prints the errors of runs by time step.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import atan, ceil, cos, cosh, inf, radians, sin, sqrt, tan, tanh
from typing import Literal

import numpy as np
from scipy.integrate import solve_ivp

from solver.arrays import Array
from solver.physics.constants import GRAVITY
from solver.physics.erosion import (
    Egashira,
    ErodibleBed,
    ErosionLaw,
    ErosionLimits,
    GrowthRate,
    JumpCondition,
    ShearStress,
    ShearWork,
)
from solver.physics.friction import Coulomb, Voellmy, friction_angle
from solver.physics.terrain import Plane
from solver.points.cloud import PointCloud, random_points
from solver.points.lattice import Lattice
from solver.result import Result
from solver.scene import Boundaries, Scene
from solver.simulation import simulate
from solver.verification.surfaces import Inclined

Layout = Literal["lattice", "cloud", "surface"]
# Cells along a run, and the share of its length that what comes from the upper side may have passed.
CELLS, PASSED = 40, 0.4
# The jump condition takes a least speed; one that no case comes down to.
SLOWEST = ErosionLimits(minimum_speed=1e-9)
HALVINGS = 4
SEED = 3
DENSITY = 2000.0


@dataclass(frozen=True)
class Uniform:
    """A uniform flow of depth h (m) and speed u (m s-1) on a plane, which takes up its bed.

    Parameters
    ----------
    angle : float
        Of the plane, degrees.
    friction : Coulomb
        The law.
    law : ErosionLaw
        Of erosion.
    depth, speed : float
        At the start.
    bed : float
        Erodible depth, m.
    time : float
        That it goes on, s.
    step : float
        Longest time step of its runs, s.
    """

    angle: float
    friction: Coulomb
    law: ErosionLaw
    depth: float
    speed: float
    bed: float
    time: float
    step: float

    def rates(self, state: Array) -> Array:
        """Rates of h and u by the equations, (2,)."""
        h, u = state
        tau, pull = self.stresses(h, u)
        rate = self.erosion(h, u) if h - self.depth < self.most(h, u) else 0.0
        return np.array([rate, (pull - tau) / h - rate * u / h])

    def erosion(self, h: float, u: float) -> float:
        """Rate of erosion as long as there is something to erode, m s-1."""
        tau = self.stresses(h, u)[0]
        match self.law:
            case GrowthRate(growth=growth):
                return growth * h * u
            case ShearStress(rate=rate):
                return rate
            case ShearWork(erosion_energy=energy):
                return tau * u / energy
            case Egashira() as law:
                return float(u * tan(radians(self.angle) - atan(law.equilibrium_slope)))
            case JumpCondition() as law:
                strength = law.bed_cohesion / DENSITY
                strength += law.strength_coefficient * h * GRAVITY * cos(radians(self.angle))
                return max(0.0, tau - strength) / (law.slip * u)
        raise TypeError(f"no rate of {self.law}")

    def stresses(self, h: float, u: float) -> tuple[float, float]:
        """Shear stress of friction, and of depth and slope, over density, m2 s-2."""
        xi, turbulent = radians(self.angle), getattr(self.friction, "turbulent_friction", inf)
        dry = h * self.friction.tangent * GRAVITY * cos(xi)
        return dry + GRAVITY * u * u / turbulent, h * GRAVITY * sin(xi)

    def most(self, h: float, u: float) -> float:
        """Depth that may be eroded at a depth and speed, m."""
        if not isinstance(self.law, ShearStress):
            return self.bed
        tau = DENSITY * self.stresses(h, u)[0 if self.law.stress == "friction" else 1]
        return min(self.bed, self.law.depth_per_stress * (tau - self.law.critical_stress))

    def at(self, time: float) -> tuple[float, float]:
        """Depth (m) and speed (m s-1) at a time, s, by the equations.

        The end of erosion is a kink of the solution; it is found by its own, and what follows is integrated
        from there.
        """

        def left(_: float, state: Array) -> float:
            h, u = map(float, state)
            return self.most(h, u) - (h - self.depth)

        left.terminal, left.direction = True, -1.0  # type: ignore[attr-defined]
        options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "max_step": time / 200}
        start = np.array([self.depth, self.speed])
        first = solve_ivp(lambda _, y: self.rates(y), (0.0, time), start, events=left, **options)
        h, u = first.y[:, -1]
        if first.status == 1:
            rest = replace(self, bed=0.0)
            after = solve_ivp(lambda _, y: rest.rates(y), (first.t[-1], time), first.y[:, -1], **options)
            h, u = after.y[:, -1]
        return float(h), float(u)

    def scene(self, layout: Layout) -> Scene:
        """Make the scene of the flow, so long that nothing from the upper side comes to its lower end."""
        fastest = max(self.speed, self.at(self.time)[1]) + 2 * sqrt(GRAVITY * (self.depth + min(self.bed, 5)))
        length = fastest * self.time / PASSED
        spacing = max(length / CELLS, fastest * self.step)
        points: Lattice | PointCloud
        if layout == "cloud":
            points = random_points((0.0, CELLS * spacing), (0.0, 4 * spacing), 4 * CELLS, SEED)
        elif layout == "surface":
            # what its outermost rows lose is felt at the speed of waves
            spacing *= cos(radians(self.angle))
            points = Lattice((0.0, CELLS * spacing), (0.0, 2 * ceil(CELLS / 2) * spacing), spacing)
        else:
            points = Lattice((0.0, CELLS * spacing), (0.0, 2 * spacing), spacing)
        nothing = np.zeros(points.shape)
        sides = Boundaries() if layout == "surface" else Boundaries("open", "open", "wall", "wall")
        return Scene(
            points,
            Inclined(0.0, self.angle) if layout == "surface" else Plane(self.angle),
            nothing + self.depth,
            nothing + self.speed,
            nothing,
            self.friction,
            boundaries=sides,
            erodible_bed=ErodibleBed(nothing + self.bed, self.law, SLOWEST),
        )

    def run(self, layout: Layout, step: float) -> tuple[float, float, Result]:
        """Run the flow by a time step, s; give depth and speed far from the upper side, and the result."""
        scene = self.scene(layout)
        count = round(self.time / step)
        result = simulate(scene, np.linspace(0.0, self.time, count + 1), frames=("depth", "velocity_x"))
        x, y = scene.points.coordinates
        near = np.abs(x - 0.9 * x.max()) + np.abs(y - y.mean())
        cell = np.unravel_index(int(np.argmin(near)), near.shape)
        return float(result.depth[(-1, *cell)]), float(result.velocity_x[(-1, *cell)]), result

    def runs(self, layout: Layout) -> Array:
        """Depth and speed by time steps, each half of the one before, (HALVINGS, 2)."""
        return np.array([self.run(layout, self.step / 2**k)[:2] for k in range(HALVINGS)])


COULOMB, VOELLMY = Coulomb(friction_angle(0.3)), Voellmy(friction_angle(0.1), 200.0)
TERMINAL = sqrt((sin(radians(20)) - 0.1 * cos(radians(20))) * 200.0)
CASES = {
    "growth rate, Coulomb": Uniform(25, COULOMB, GrowthRate(0.005), 1, 0, 100, 10, 0.5),
    "growth rate, Voellmy": Uniform(20, VOELLMY, GrowthRate(0.005), 1, 0, 100, 10, 0.5),
    "shear stress, depth and slope": Uniform(
        20, VOELLMY, ShearStress(density=DENSITY), 1, TERMINAL, 100, 10, 0.5
    ),
    "shear stress, friction": Uniform(
        20, VOELLMY, ShearStress(stress="friction", density=DENSITY), 1, TERMINAL, 100, 10, 0.5
    ),
    "shear work": Uniform(20, VOELLMY, ShearWork(), 1, TERMINAL, 100, 10, 0.5),
    "Egashira": Uniform(25, Coulomb(friction_angle(0.35)), Egashira(), 1, 5, 100, 5, 0.25),
    "jump condition": Uniform(20, VOELLMY, JumpCondition(0.3), 1, TERMINAL, 100, 10, 0.5),
}


def growth_by_coulomb(
    angle: float, coefficient: float, growth: float, time: float, depth: float = 1.0
) -> tuple[float, float]:
    """Depth (m) and speed (m s-1) of a flow from rest that grows by G (m-1) of its way: a closed form."""
    xi = radians(angle)
    pull = GRAVITY * (sin(xi) - coefficient * cos(xi))
    w = sqrt(pull * growth)
    return depth * cosh(w * time), sqrt(pull / growth) * tanh(w * time)


def report() -> Iterator[str]:
    """Give the table of errors by time step, line by line."""
    parts = ", ".join(["dt", *(f"dt/{2**k}" for k in range(1, HALVINGS))])
    yield f"| case | t, s | h, m | u, m s-1 | dt, s | error of h with {parts} | error of u |"
    yield "|---|---|---|---|---|---|---|"
    for name, case in CASES.items():
        known = case.at(case.time)
        errors = case.runs("lattice") - known
        told = (", ".join(f"{error:.1e}" for error in column) for column in errors.T)
        values = " | ".join(f"{value:.6g}" for value in (case.time, *known, case.step))
        yield f"| {name} | {values} | {' | '.join(told)} |"


if __name__ == "__main__":
    for line in report():
        print(line, flush=True)
