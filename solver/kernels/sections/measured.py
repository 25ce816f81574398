"""What passes named sections: volumes by the fluxes through their faces, and when."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from solver.arrays import Array, Indices
from solver.compiled import kernel
from solver.kernels.state import Fluxes
from solver.referenced import by_reference


@by_reference
class Sections(NamedTuple):
    """Faces of sections, sorted by the row that their fluxes are found with.

    Attributes
    ----------
    first
        The faces of padded row j are ``first[j]`` to ``first[j + 1]``.
    along_x
        1 for a face on the low side of its column along x, 0 for one between row j and the next.
    column, section
        Of the face, and the number of its section. On a cloud the face's own number stands for the column,
        and ``first`` and ``along_x`` are empty.
    weight
        What a flux of mass is multiplied by for the discharge in the direction of the section.
    volume
        Volume that has passed each section so far, net, shape (sections,), m3.
    times, series
        Times of samples, shape (n,), s, and the volume that has passed by then, shape (n, sections), m3.
    last
        Time and volumes at the end of the step before, shape (1 + sections,).
    taken
        Number of samples so far, shape (1,).
    """

    first: Indices
    along_x: Indices
    column: Indices
    section: Indices
    weight: Array
    volume: Array
    times: Array
    series: Array
    last: Array
    taken: Indices


@kernel()
def measure(
    sections: Sections,
    row: int,
    x_span: tuple[int, int],
    y_span: tuple[int, int],
    x_fluxes: Fluxes,
    y_fluxes: Fluxes,
    ring: int,
    time: float,
) -> None:
    """Add what passes the faces of a row in a stage to the volumes of their sections.

    Parameters
    ----------
    x_span, y_span : tuple of int
        Half-open ranges of the columns whose faces along x and along y have fluxes; nothing passes others.
    ring : int
        Index of column 0 of the row in the fluxes.
    time : float
        Weight of the stage in the step times its length, s.
    """
    for n in range(sections.first[row], sections.first[row + 1]):
        c = sections.column[n]
        if sections.along_x[n] == 1:
            # the last cell has a face on either side
            mass = x_fluxes.mass[ring + c] if x_span[0] < x_span[1] and x_span[0] <= c <= x_span[1] else 0.0
        else:
            mass = y_fluxes.mass[ring + c] if y_span[0] <= c < y_span[1] else 0.0
        sections.volume[sections.section[n]] += time * sections.weight[n] * mass


@kernel()
def sample(sections: Sections, time: float) -> None:
    """Take the samples that are due by a time (s), linear within the step that has ended."""
    start, n = sections.last[0], len(sections.volume)
    while sections.taken[0] < len(sections.times) and sections.times[sections.taken[0]] <= time:
        i = sections.taken[0]
        share = (sections.times[i] - start) / (time - start) if time > start else 1.0
        for k in range(n):
            before = sections.last[1 + k]
            after = sections.volume[k]
            sections.series[i, k] = after if share >= 1.0 else before + share * (after - before)
        sections.taken[0] += 1
    sections.last[0] = time
    for k in range(n):
        sections.last[1 + k] = sections.volume[k]


def no_sections() -> Sections:
    """Give what kernels are given where nothing is measured."""
    whole, real = np.zeros(0, np.int64), np.zeros(0)
    return Sections(
        *(whole,) * 4,
        weight=real,
        volume=real,
        times=real,
        series=np.zeros((0, 0)),
        last=np.zeros(1),
        taken=np.zeros(1, np.int64),
    )


def begun(count: int, times: Array) -> Sections:
    """Give what is measured at some sections before the first step, without their faces.

    Parameters
    ----------
    count : int
        Number of sections.
    times : (n,) array
        Times of samples, s.
    """
    series = np.full((len(times), count), np.nan)
    return no_sections()._replace(
        volume=np.zeros(count), times=times, series=series, last=np.zeros(1 + count)
    )
