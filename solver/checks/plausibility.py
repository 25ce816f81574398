"""What makes the result of a run doubtful although the run went on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from solver.arrays import Array
from solver.checks.heights import area_and_height
from solver.checks.incoming import Coming, coming_in
from solver.checks.invariants import LEDGER, SPEED, Laws
from solver.checks.states import State
from solver.physics.elevation import Surface
from solver.points.lattice import Lattice
from solver.result import Result
from solver.scene import Collocation, Scene

# Shares of the volume released, come in and entrained: what the collocation form may make or lose, what may
# lie below a depth of zero, and what may be so thin at the end that it counts as dry.
COLLOCATION_LEDGER, BELOW_ZERO, TOO_THIN = 1e-3, 1e-3, 1e-2


def doubts(scene: Scene, result: Result) -> Iterator[str]:
    """Say what of a result is doubtful, in a few words each.

    On a surface no speed may be above that of a fall from the highest point of the release to the lowest
    that the flow reached.
    """
    ledger, h = result.ledger, result.deposit_depth
    total = ledger.total
    if not total > 0:
        return
    if not abs(ledger.error) <= (COLLOCATION_LEDGER if isinstance(scene.scheme, Collocation) else LEDGER):
        yield f"the ledger of volume is off by {ledger.error:.2g}"
    if not abs(ledger.bed_error) <= LEDGER:
        yield f"what the bed lost differs from what the flow took up by {ledger.bed_error:.2g} of the volume"
    surface = scene.terrain if isinstance(scene.terrain, Surface) else None
    if surface is not None:
        area: float | Array
        area, height = area_and_height(surface, scene.points)
        coming = coming_in(scene)
        deepest = float(scene.depth.max()) if coming is None else max(float(scene.depth.max()), coming.depth)
        dry = scene.scheme.wet_limit * deepest
        limit = speed_of_fall(scene, height, result, coming)
    else:
        laws = laws_of_speed(scene)
        area, dry = scene.points.cell_area, laws.dry
        laws.deepest = max(laws.deepest, float(result.max_depth.max()))
        limit = laws.speed_limit(result.time)
    below = float((area * np.maximum(-h, 0.0)).sum()) / total
    if below > BELOW_ZERO:
        yield f"{100 * below:.2g} % of the volume lies below a depth of zero"
    thin = float((area * np.where((h > 0) & (h <= dry), h, 0.0)).sum()) / total
    if thin > TOO_THIN:
        yield f"{100 * thin:.2g} % of the volume is so thin that it counts as dry"
    fastest = float(result.max_speed.max())
    if fastest > SPEED * limit:
        yield f"a speed of {fastest:.3g} m s-1 is {fastest / limit:.2g} times what it has a source for"


def speed_of_fall(scene: Scene, middle: Array, result: Result, coming: Coming | None = None) -> float:
    """Speed of a free fall from the top of a release to the lowest place that its flow reached, m s-1.

    What comes in begins with its speed. middle : elevations of the cells, of the shape of the points, m.
    """
    released, reached = scene.depth > 0, result.max_depth > 0
    first = 0.0
    if coming is not None:
        released = released.copy()
        released[coming.cells] = True
        first = coming.speed + 2 * float(np.sqrt(scene.gravity * coming.depth))
    if not (released.any() and reached.any()):
        return float("inf")
    height = float(middle[released].max() - middle[reached].min()) + float(result.max_depth.max())
    return float(np.sqrt(2 * scene.gravity * max(height, 0.0) + first**2))


def laws_of_speed(scene: Scene) -> Laws:
    """Make the laws that say how fast a scene may become; a lattice's bed varies along it alone.

    Raises
    ------
    TypeError
        If the terrain is no slope profile.
    """
    points, h, speed = scene.points, scene.depth, np.hypot(scene.velocity_x, scene.velocity_y)
    coming = coming_in(scene)
    if isinstance(points, Lattice):
        spacing = points.spacing
        points = Lattice(points.x, (0.0, spacing), spacing)
        moving = np.where(h > scene.scheme.wet_limit * h.max(), speed, 0.0)
        h, speed = (np.broadcast_to(a.max(axis=0), points.shape) for a in (h, moving))
    # what is taken up was at rest, and is not faster than what takes it up
    reduced = replace(
        scene,
        points=points,
        depth=h,
        velocity_x=speed,
        velocity_y=0.0 * speed,
        erodible_bed=None,
        inflows=(),
        sections=(),
    )
    return Laws(reduced, State(h, speed, reduced.velocity_y, 0.0, np.zeros((4, 2))), 1.0, coming)
