"""What the kernels of a collocation run read and write."""

from __future__ import annotations

from typing import NamedTuple

from solver.arrays import Array, Indices
from solver.collocation.operators import Stencils
from solver.kernels.record import Record
from solver.kernels.state import CloudBed, Fields, Material


class Images(NamedTuple):
    """How images mirror the velocities of their points.

    Attributes
    ----------
    owner
        (points and images,), number of each point itself, of each image its point's.
    sign
        (images, 2), factor of either component.
    outward
        (images, 2), 1 where the component is first made positive.
    """

    owner: Indices
    sign: Array
    outward: Indices


class Momenta(NamedTuple):
    """Depth (m) and momentum (m2 s-1) of points and images, flat arrays."""

    h: Array
    hu: Array
    hv: Array


class Open(NamedTuple):
    """What open sides let out: pairs of a point and an image beyond an open side, as `open_sides` lists them.

    Attributes
    ----------
    point, image, side
        (m,).
    weight
        (m, 2), of the momentum of both along and across, m.
    """

    point: Indices
    image: Indices
    side: Indices
    weight: Array


class Scratch(NamedTuple):
    """Scratch arrays of a run.

    Attributes
    ----------
    start
        State at the start of the step.
    q
        State after a stage; where nothing is chosen, that in force.
    change
        What relaxation makes of it.
    gains
        (n, 5), filled by `derivatives`.
    beta
        (n, 2), g cos(xi) K (eq. 7) along x and y, m s-2.
    mark, flag, chosen
        (n,).
    """

    start: Fields
    q: Momenta
    change: Momenta
    gains: Array
    beta: Array
    mark: Indices
    flag: Indices
    chosen: Indices


class Relaxation(NamedTuple):
    """How the state is relaxed after each stage.

    Attributes
    ----------
    omega
        Of eq. 25, 0 for none.
    threshold
        Of eq. 24.
    floor
        Least depth that eq. 24 divides by, m.
    pairs
        1 to exchange between pairs, 0 for eq. 25 as printed.
    momentum
        1 to relax momentum too.
    clip
        1 to set negative depths to zero afterwards.
    """

    omega: float
    threshold: float
    floor: float
    pairs: int
    momentum: int
    clip: int


class CollocationArrays(NamedTuple):
    """What the kernels of a run read and write.

    Attributes
    ----------
    coordinates, area
        Of points and images, as of `CollocationOperators`.
    film, around
        As `velocities` takes them.
    """

    now: Fields
    coordinates: Array
    area: Array
    stencils: Stencils
    images: Images
    open: Open
    bed: CloudBed
    material: Material
    relaxation: Relaxation
    film: float
    around: int
    scratch: Scratch
    record: Record
