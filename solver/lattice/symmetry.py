"""A flow that is its own mirror image, of which one half is computed."""

from __future__ import annotations

from solver.compiled import kernel
from solver.kernels.state import AXIS, GHOSTS, MIDLINE, Fluxes, Sides


@kernel()
def images(sides: Sides, row: int) -> float:
    """Count a padded row with its mirror image, where only one half is computed."""
    if sides.kind[2] == AXIS:
        return 1.0 if row == GHOSTS else 2.0
    return 2.0 if sides.kind[2] == MIDLINE else 1.0


@kernel()
def mirror_fluxes(fluxes: Fluxes, at: int, source: int, count: int) -> None:
    """Give faces below the cells of an axis, from index ``at`` on, the mirror images of the fluxes above."""
    for k in range(count):
        fluxes.mass[at + k], fluxes.normal[at + k] = -fluxes.mass[source + k], fluxes.normal[source + k]
        fluxes.tangential[at + k] = -fluxes.tangential[source + k]
        fluxes.pressure[at + k] = fluxes.pressure[source + k]
