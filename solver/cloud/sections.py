"""What comes in through the faces of a cloud, and what passes those that are measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from solver.arrays import Array, Indices
from solver.cloud.blocks import Activity
from solver.cloud.faces import Faces, own_normals
from solver.cloud.fluxes import CloudBuffers
from solver.cloud.reconstruction import Gradient
from solver.compiled import kernel
from solver.inflow.clouds import PlacedOnCloud
from solver.inflow.entrance import Entrance
from solver.inflow.hydrograph_kernels import graphs_of
from solver.kernels.flow_axes import normal_pressure, sheared
from solver.kernels.sections.inflow import Inflows, held_up, state_in_door
from solver.kernels.sections.measured import Sections, begun
from solver.kernels.state import BELOW_YIELD, LANES, CloudBed, Fields, Status
from solver.referenced import by_reference


@by_reference
class Doors(NamedTuple):
    """The faces that flow comes in through, sorted by the cell that it comes into.

    Attributes
    ----------
    face
        Its number.
    above
        The cell on the other side, or the ghost.
    parted, neighbour
        Cells, and which of the neighbours of `Gradient` of theirs lies above a section that they are below,
        sorted by cell.
    """

    face: Indices
    above: Indices
    parted: Indices
    neighbour: Indices


def doors_of(
    entrances: Sequence[Entrance],
    faces: Faces,
    gradient: Gradient,
    places: Array,
    bed: CloudBed,
    area: Array,
    widths: Array,
    number: Indices | None = None,
) -> tuple[Inflows, Doors]:
    """Give inflows to the kernels.

    Parameters
    ----------
    entrances : sequence of Entrance
        On the cloud of these faces and supports.
    places : array
        Of the points, (n, 2), m.
    bed : CloudBed
        Of the cells, whose frames are those of these faces.
    area : array
        Of the cells, m2.
    widths : array
        From `solver.cloud.status.widths_of`.
    number : array, optional
        Of `solver.cloud.operators.CloudOperators`.
    """
    placed = [each.placed for each in entrances if isinstance(each.placed, PlacedOnCloud)]
    section = np.repeat(np.arange(len(placed)), [len(each.face) for each in placed])
    face, sign, cell = (
        np.concatenate([getattr(each, name) for each in placed]) for name in ("face", "sign", "downstream")
    )
    order = np.lexsort((face, section, cell))
    section, face, sign, cell = section[order], _numbers(face, faces, number)[order], sign[order], cell[order]
    width, bottom = (
        np.concatenate([getattr(each, name) for each in placed])[order] for name in ("width", "bottom")
    )
    slant = np.array([each.slant for each in entrances])[section]
    own = faces.geometry[:2, face] if faces.far is None else _normals_below(faces, faces.far, face, sign)
    x, y = _on_bed(np.array([each.direction for each in placed])[section].T, bed, cell)
    along, across = own[0] * x + own[1] * y, own[0] * y - own[1] * x
    # the rate of the waves that leave a cell, as `set_status` has it, in what `await_inflow` makes of it
    w_x, w_y, around = widths[:3, cell]
    rate = np.maximum(around / 2, (w_x * abs(x) + w_y * abs(y)) / (abs(along) + abs(across)))
    n, none = len(face), np.zeros(0, np.int64)
    above = np.where(sign > 0, faces.left[face], faces.right[face]).astype(np.int64)
    inside = np.where(above < faces.cells, above, cell)
    inflows = Inflows(
        first=np.searchsorted(cell, np.arange(0, faces.cells + 1, LANES)),
        closed=none,
        order=none,
        cell=cell,
        column=none,
        side=none,
        section=section,
        sign=sign.astype(float),
        along=along,
        across=across,
        own=own,
        width=width,
        length=np.ones(n),
        bottom=bottom,
        slant=slant,
        edge=faces.geometry[6, face],
        room=area[np.stack([inside, cell])] / faces.geometry[6, face],
        beta=bed.normal[cell],
        rate=np.stack([rate, rate]),
        falling=bed.falling[cell],
        mass=np.zeros(n),
        depth=np.zeros(n),
        speed=np.zeros(n),
        **graphs_of(entrances),
        before=np.zeros((4, 0)),
    )
    parted, neighbour = _parted(placed, gradient, places)
    return inflows, Doors(face, above, parted, neighbour)


def _normals_below(faces: Faces, far: Array, face: Indices, sign: Indices) -> Array:
    """Give the normals of faces in the frames of the cells that flow comes into, (2, n)."""
    return np.where(sign > 0, far[:2, face], faces.geometry[:2, face])


def _on_bed(way: Array, bed: CloudBed, cell: Indices) -> Array:
    """Turn directions in plan, (2, n), into the unit vectors on the bed above them, in frames of cells."""
    if bed.lift is None:
        return way
    p, r, q = bed.lift.p[cell], bed.lift.r[cell], bed.lift.q[cell]
    over = np.stack([(way[0] - r * (way[1] / q)) / p, way[1] / q])
    return np.asarray(over / np.hypot(*over))


def _parted(placed: Sequence[PlacedOnCloud], gradient: Gradient, places: Array) -> tuple[Indices, Indices]:
    """Find what `Doors` has of neighbours above sections."""
    n = len(places)
    cell = np.tile(np.arange(n), len(gradient.neighbours))
    others = gradient.neighbours[:, :n].ravel().astype(np.int64)
    slot = np.repeat(np.arange(len(gradient.neighbours)), n)
    real = others != cell
    cell, others, slot = cell[real], others[real], slot[real]
    apart = np.zeros(len(cell), bool)
    for each in placed:
        apart |= each.parts(places[cell], places[others])
    cell, slot = cell[apart], slot[apart]
    order = np.lexsort((slot, cell))
    return cell[order], slot[order]


def _numbers(face: Indices, faces: Faces, number: Indices | None) -> Indices:
    """Numbers among `Faces` of faces of a cloud; below 0 for those in buildings."""
    face = face if number is None else number[face]
    inner = int(faces.first[-1])
    return np.where(face < inner, face, face - inner + faces.outer)


def no_doors() -> Doors:
    """Give what kernels are given where nothing comes in."""
    return Doors(*(np.zeros(0, np.int64) for _ in range(4)))


def sections_of(
    gauges: Sequence[PlacedOnCloud], times: Array, faces: Faces, number: Indices | None = None
) -> Sections:
    """Give sections to the kernels, with the times of their samples, s, and ``number`` as in `doors_of`."""
    none = np.zeros(0, np.int64)
    section = np.repeat(np.arange(len(gauges)), [len(each.face) for each in gauges])
    sign = np.concatenate([each.sign for each in gauges]).astype(float)
    column = _numbers(np.concatenate([each.face for each in gauges]), faces, number)
    # nothing passes a face in a building
    there = column >= 0
    return begun(len(gauges), times)._replace(
        first=none,
        along_x=none,
        column=column[there],
        section=section[there],
        weight=sign[there],
    )


@kernel()
def open_blocks(inflows: Inflows, static: Array, moving: Array) -> None:
    """Let the cells that flow comes into take part in a step.

    Parameters
    ----------
    static : array
        Status of the cells, set to 0 where flow comes in.
    moving : array
        Flags of blocks.
    """
    for e in range(len(inflows.cell)):
        if inflows.opened[inflows.section[e]] > 0.0:
            # below a face that nothing comes in through cells are what they are
            if inflows.mass[e] > 0.0:
                static[inflows.cell[e]] = 0.0
            moving[inflows.cell[e] // LANES] = 1


@kernel()
def forget_above(
    now: Fields, gradient: Gradient, doors: Doors, start: int, stop: int, dry: float, slopes: Array
) -> None:
    """Take out of the slopes of a run of cells what is dry above a section that they are below.

    What comes in there has a depth, which the dry cells above do not show.

    Parameters
    ----------
    start, stop, dry, slopes
        As of `solver.cloud.reconstruction.slopes_at`.
    """
    for k in range(len(doors.parted)):
        i, m = doors.parted[k], doors.neighbour[k]
        if start <= i < stop:
            j = int(gradient.neighbours[m, i])
            if now.h[j] <= dry:
                step = now.h[j] - now.h[i]
                slopes[0, i] -= gradient.along[m, i] * step
                slopes[1, i] -= gradient.across[m, i] * step


@kernel()
def push_on(status: Status, faces: Faces, f: int, cell: int) -> tuple[float, float]:
    """Length times normal of a face times the pressure of a cell there, m2 s-2; 0 for one below yield."""
    if status.static[cell] == BELOW_YIELD:
        return 0.0, 0.0
    left, right = own_normals(faces.far, f, faces.geometry[0, f], faces.geometry[1, f])
    n_x, n_y = left if cell == faces.left[f] else right
    l_x, l_y = faces.geometry[6, f] * n_x, faces.geometry[6, f] * n_y
    x, y = sheared(status.beta_xy, cell, l_x, l_y)
    return l_x * status.beta_x[cell] + x, l_y * status.beta_y[cell] + y


@kernel()
def close_doors(
    inflows: Inflows,
    doors: Doors,
    now: Fields,
    status: Status,
    faces: Faces,
    buffers: CloudBuffers,
    start: int,
    stop: int,
    dt: float,
) -> None:
    """Let nothing out against the flow through some faces, as `close_to_backflow` does on a lattice.

    Parameters
    ----------
    start, stop : int
        First face, and the one after the last; those before it in its line of the cache are made anew too.
    dt : float
        Time step, s.
    """
    halves, n = buffers.halves, faces.faces
    for e in range(len(doors.face)):
        f = doors.face[e]
        if f < start // LANES * LANES or f >= stop or inflows.flowing[inflows.section[e]] <= 0.0:
            continue
        if inflows.sign[e] * halves[0, n + f] > 0.0:
            continue
        pressure = 0.5 * now.h[doors.above[e]] ** 2
        buffers.pressed[f] = pressure
        for side in range(2):
            half, cell = (f, int(faces.left[f])) if side == 0 else (n + f, int(faces.right[f]))
            x, y = push_on(status, faces, f, cell)
            into = (2 * side - 1) * pressure
            halves[0, half], halves[1, half], halves[2, half] = 0.0, into * x, into * y
            if cell == doors.above[e]:
                x, y = hold_up(now, status, faces, f, cell, -inflows.sign[e], inflows.room[0, e], dt)
                halves[1, half] += x
                halves[2, half] += y


@kernel()
def hold_up(
    now: Fields, status: Status, faces: Faces, f: int, cell: int, out: float, room: float, dt: float
) -> tuple[float, float]:
    """Rate of momentum that a face which is closed to backflow gives to what moves to it, m4 s-2.

    Parameters
    ----------
    out : float
        -1 where the cell is before the face, by its normal, 1 where it is beyond.
    room : float
        Area of the cell over the length of the face, m.
    dt : float
        Time step, s.
    """
    left, right = own_normals(faces.far, f, faces.geometry[0, f], faces.geometry[1, f])
    n_x, n_y = left if cell == faces.left[f] else right
    h, toward = now.h[cell], -out * (n_x * now.u[cell] + n_y * now.v[cell])
    beta = normal_pressure(status.beta_xy, cell, status.beta_x[cell], status.beta_y[cell], n_x, n_y)
    push = out * faces.geometry[6, f] * held_up(h, toward, math.sqrt(beta * h), h, room, dt)
    return push * n_x, push * n_y


@kernel()
def admit_into(
    inflows: Inflows,
    doors: Doors,
    block: int,
    now: Fields,
    status: Status,
    faces: Faces,
    buffers: CloudBuffers,
    dt: float,
) -> None:
    """Add what comes into the cells of a block to what their faces add up to.

    The cells on the other side do not lose it. Pressure is that of `solver.kernels.sections.inflow.admit`.
    """
    gain = buffers.gain
    for e in range(inflows.first[block], inflows.first[block + 1]):
        mass, depth, speed = inflows.mass[e], inflows.depth[e], inflows.speed[e]
        if inflows.flowing[inflows.section[e]] <= 0.0:
            continue
        i, f, sign = inflows.cell[e], doors.face[e], inflows.sign[e]
        if mass <= 0.0:
            if buffers.halves[0, f] == 0.0:
                # nothing comes in so high up, and what is closed to backflow is a wall on both sides
                x, y = push_on(status, faces, f, i)
                more = sign * (0.5 * now.h[i] * now.h[i] - buffers.pressed[f])
                push = hold_up(now, status, faces, f, i, sign, inflows.room[1, e], dt)
                gain[1, i] += more * x + push[0]
                gain[2, i] += more * y + push[1]
            continue
        n_x, n_y, along, across = inflows.own[0, e], inflows.own[1, e], inflows.along[e], inflows.across[e]
        beta = normal_pressure(status.beta_xy, i, status.beta_x[i], status.beta_y[i], n_x, n_y)
        inside = sign * (n_x * now.u[i] + n_y * now.v[i])
        depth, speed = state_in_door(depth, speed, abs(along), inside, now.h[i], beta)
        pressure, before = 0.5 * depth * depth, buffers.pressed[f]
        # what flows through the section anyhow may press more
        if buffers.halves[0, f] != 0.0:
            pressure = max(before, pressure)
        x, y = push_on(status, faces, f, i)
        more = sign * (pressure - before)
        gain[0, i] += mass
        gain[1, i] += mass * speed * (along * n_x - across * n_y) + more * x
        gain[2, i] += mass * speed * (along * n_y + across * n_x) + more * y


@kernel()
def measure_faces(sections: Sections, faces: Faces, activity: Activity, halves: Array, time: float) -> None:
    """Add what passes the faces of sections in a stage to their volumes.

    Parameters
    ----------
    halves : array
        Of `solver.cloud.fluxes.CloudBuffers`; those of faces that did not take part are of steps before.
    time : float
        Weight of the stage in the step times its length, s.
    """
    for n in range(len(sections.column)):
        f = sections.column[n]
        block = int(faces.left[f]) // LANES
        taken = activity.fluxed[block] if f < faces.outer else activity.stepped[block]
        if taken:
            sections.volume[sections.section[n]] -= time * sections.weight[n] * halves[0, f]
