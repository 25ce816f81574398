"""What a cell-stage of a whole run costs by each law of friction, beside dry friction in the same sitting.

``python -m pipeline.studies.kernels "Laws of friction"`` prints the table; so does `pipeline bench` without
``--quick``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from statistics import median

import numpy as np

from pipeline.settings.generated import tag
from solver.physics.friction import (
    Bingham,
    Chezy,
    Coulomb,
    Edwards,
    Friction,
    HerschelBulkley,
    Manning,
    OBrien,
    Pouliquen,
    Voellmy,
)
from solver.physics.terrain import Plane
from solver.points.lattice import Lattice
from solver.scene import Boundaries, Scene
from solver.simulation import simulate

# A layer that is wet and moves throughout, on a plane in degrees, for some s; m and m s-1.
LENGTH, WIDTH, SLOPE, TIME = 128.0, 32.0, 25.0, 2.0
DEPTH, SPEED = 1.0, 5.0
SPACING, REPEATS = 0.25, 7
_DENSITY = 2000.0
MEASURED: dict[str, Friction] = {
    tag(type(law)): law
    for law in (
        Coulomb(15.0),
        Voellmy(6.0, 300.0),
        Chezy(20.0),
        Manning(0.05),
        OBrien(1000.0, 100.0, 0.05, density=_DENSITY),
        Bingham(1000.0, 100.0, density=_DENSITY),
        HerschelBulkley(1000.0, 300.0, 0.5, density=_DENSITY),
        Pouliquen((15.0, 30.0), 0.136, 0.2),
        Edwards((15.0, 30.0, 18.0), 0.136, 0.2, 0.136),
    )
}
# forms of other laws, and the first once more: what it differs from itself by is the noise of the sitting
OTHERS: dict[str, Friction] = {
    "voellmy, cohesion": Voellmy(6.0, 300.0, 500.0, _DENSITY),
    "bingham, linear": Bingham(1000.0, 100.0, "linear", density=_DENSITY),
    "coulomb, again": MEASURED[tag(Coulomb)],
}
COLUMNS = ("law", "steps", "million cell-stages a s", "times the cost of coulomb", "least and largest")


@dataclass(frozen=True)
class LawCost:
    """Cost of runs by one law.

    Parameters
    ----------
    name : str
        Of the law.
    steps, cell_stages : int
        Of one run.
    times : tuple of float
        Thread CPU seconds of the time loop, one a repeat.
    """

    name: str
    steps: int
    cell_stages: int
    times: tuple[float, ...]

    @property
    def rate(self) -> float:
        """Cell-stages per CPU second, by the median of the repeats."""
        return self.cell_stages / median(self.times)

    def beside(self, other: LawCost) -> tuple[float, ...]:
        """Cost of a cell-stage over that of another law, one a repeat."""
        return tuple(
            (one / self.cell_stages) / (two / other.cell_stages)
            for one, two in zip(self.times, other.times, strict=True)
        )


def scene_of(law: Friction, spacing: float = SPACING) -> Scene:
    """Make the scene of a law, on a lattice of a spacing, m."""
    lattice = Lattice((0.0, LENGTH), (0.0, WIDTH), spacing)
    x, y = lattice.coordinates
    # rows that are alike would be run once
    layer = DEPTH + 0.1 * np.sin(x / 5.0) + 0.1 * np.sin(y / 3.0)
    sides = Boundaries("open", "open", "wall", "wall")
    return Scene(lattice, Plane(SLOPE), layer, 0.0 * layer + SPEED, 0.0 * layer, law, boundaries=sides)


def law_costs(
    laws: Mapping[str, Friction] | None = None, spacing: float = SPACING, repeats: int = REPEATS
) -> list[LawCost]:
    """Time runs by laws of friction, all of them in turn in each repeat.

    Parameters
    ----------
    laws : mapping, optional
        Laws by name; by default all, and some forms of them.
    spacing : float
        m.
    repeats : int
        How often.

    Raises
    ------
    RuntimeError
        If a run fails.
    """
    chosen = {**MEASURED, **OTHERS} if laws is None else laws
    scenes = {name: scene_of(law, spacing) for name, law in chosen.items()}
    # compiles
    runs = {name: simulate(scene, [TIME]) for name, scene in scenes.items()}
    for name, run in runs.items():
        if run.failure is not None:
            raise RuntimeError(f"{name}: {run.failure.reason}")
    times: dict[str, list[float]] = {name: [] for name in scenes}
    for _ in range(repeats):
        for name, scene in scenes.items():
            times[name].append(simulate(scene, [TIME]).cpu_time)
    return [LawCost(name, run.steps, run.cell_stages, tuple(times[name])) for name, run in runs.items()]


def by_law() -> Iterator[list[str]]:
    """Time all laws; a line for each, as cells."""
    costs = law_costs()
    for cost in costs:
        ratios = cost.beside(costs[0])
        spread = f"{min(ratios):.2f} to {max(ratios):.2f}"
        yield [cost.name, str(cost.steps), f"{cost.rate / 1e6:.1f}", f"{median(ratios):.2f}", spread]
