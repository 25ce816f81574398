"""What a run on an elevation model comes down to: reach, drop, deposit, and what its cells do not show."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from pipeline.readable import percent
from pipeline.runs.scene_of_run import Prepared
from solver.physics.elevation import ElevationModel, edges_of, plan_slopes
from solver.points.cloud import PointCloud
from solver.points.lattice import Lattice
from solver.points.on_surface import mean_slopes

Array = NDArray[np.float64]
Cell = tuple[np.intp, ...]
# what is thinner has no speed that counts, m
FILM = 0.05
# Cells across a channel below which flow spills that a channel of the ground would hold.
LEAST_CELLS = 4
# steps of a way over the ground, rows and columns
WAYS = ((0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (2, 1), (1, -2), (2, -1))
# points around one, itself among them, that a way over a cloud may go on to
NEAREST = 25
# cells whose mean gives the direction of the ground, on a side
AROUND = 11
# cells of a narrow channel that hang together before it is told
LONG = 10
# begins the warning of a run, by which it is counted
NARROW = "a channel narrower than"


def summarise_on_surface(
    points: Lattice | PointCloud,
    elevation: Array,
    area: Array,
    release_depth: Array,
    deposit_depth: Array,
    max_depth: Array,
    max_speed: Array,
    threshold: float,
) -> dict[str, float]:
    """Summaries of a run, by name of variable.

    The deposit is where its depth is above the threshold. The crown is the highest cell of the release, the
    toe the lowest cell of the deposit; of equally high ones those farthest from each other. Distances are
    horizontal and straight, from crown to toe. The area of the deposit is in plan, volumes are by the area on
    the bed.

    Parameters
    ----------
    points : Lattice or PointCloud
        Eastings and northings; the shape of arrays below is theirs.
    elevation : array
        Of the bed, m; NaN where nothing is known.
    area : array
        Of the cells on the bed, m2.
    release_depth, deposit_depth, max_depth : array
        Depth at the start, in the last state, and the largest over all time steps, m.
    max_speed : array
        Largest speed over all time steps, m s-1; that of films does not count.
    threshold : float
        Depth above which a cell belongs to the deposit, or was reached by the flow, m.

    Returns
    -------
    dict of str to float
        The summaries of ``pipeline.store.variables`` that have a meaning on a surface; of a deposit that is
        not there its area and volume, which are 0.
    """
    thick = max_depth > FILM
    found = {
        "peak_depth": float(np.max(max_depth)),
        "peak_speed": float(max_speed[thick].max()) if thick.any() else 0.0,
    }
    known = np.isfinite(elevation)
    covered, reached = deposit_depth > threshold, max_depth > threshold
    release = (release_depth > 0) & known
    found |= {
        "deposit_area": plan_area(points, covered),
        "deposit_volume": float((deposit_depth * area)[covered].sum()),
    }
    if covered.any():
        found["deposit_max_depth"] = float(deposit_depth[covered].max())
    if (reached & known).any():
        found["lowest_elevation"] = float(elevation[reached & known].min())
    if not release.any():
        return found
    if (reached & known).any():
        crown, lowest = _between(points, elevation, release, reached & known)
        found["flow_runout_distance"] = _distance(points, crown, lowest)
        found["flow_path_length"] = (
            path_length(points.dx, elevation, (reached & known) | release, crown, lowest)
            if isinstance(points, Lattice)
            else path_between_points(points, elevation, (reached & known) | release, crown, lowest)
        )
    if (covered & known).any():
        crown, toe = _between(points, elevation, release, covered & known)
        runout, drop = _distance(points, crown, toe), float(elevation[crown] - elevation[toe])
        found |= {
            "runout_distance": runout,
            "drop_height": drop,
            "reach_angle": float(np.degrees(np.arctan2(drop, runout))),
        }
    return found


def plan_area(points: Lattice | PointCloud, cells: NDArray[np.bool_]) -> float:
    """Area in plan of some cells, m2."""
    if isinstance(points, Lattice):
        return float(cells.sum()) * points.cell_area
    return float(points.cell_area[cells].sum())


def path_between_points(
    points: PointCloud, elevation: Array, reached: NDArray[np.bool_], start: Cell, stop: Cell
) -> float:
    """Length of the shortest way as `path_length` has it, on a cloud from each point to those nearest to it.

    Parameters
    ----------
    points : PointCloud
        In plan.
    elevation : array
        Of the bed, (n,), m.
    reached : array
        Points that the way may go over, (n,).
    start, stop : tuple of int
        Numbers of the ends.

    Returns
    -------
    float
        NaN where no way leads from one to the other.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    count = min(NEAREST, len(points))
    near, (x, y) = points.nearest(count), points.coordinates
    one, other = np.repeat(near[:, 0], count - 1), near[:, 1:].ravel()
    both = reached[one] & reached[other]
    one, other = one[both], other[both]
    way = np.sqrt(
        (x[other] - x[one]) ** 2 + (y[other] - y[one]) ** 2 + (elevation[other] - elevation[one]) ** 2
    )
    graph = coo_array((way, (one, other)), shape=(len(points), len(points))).tocsr()
    found = float(dijkstra(graph, directed=False, indices=start[0])[stop[0]])
    return found if np.isfinite(found) else float("nan")


def path_length(
    spacing: float, elevation: Array, reached: NDArray[np.bool_], start: Cell, stop: Cell
) -> float:
    """Length over the ground of the shortest way between two cells within what a flow reached, m.

    The way goes in sixteen directions, which makes it at most 3 % too long.

    Parameters
    ----------
    spacing : float
        Side of a cell in plan, m.
    elevation : array
        Of the bed, (ny, nx), m.
    reached : array
        Cells that the way may go through, (ny, nx).
    start, stop : tuple of int
        Row and column of the ends.

    Returns
    -------
    float
        NaN where no way leads from one to the other.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    ny, nx = elevation.shape
    numbers = np.full((ny, nx), -1)
    numbers[reached] = np.arange(int(reached.sum()))
    if numbers[start] < 0 or numbers[stop] < 0:
        return float("nan")
    ends, lengths = [], []
    for rows, columns in WAYS:
        low = slice(0, ny - rows)
        high = slice(rows, None)
        left, right = (
            (slice(0, nx - columns), slice(columns, None))
            if columns >= 0
            else (slice(-columns, None), slice(0, columns))
        )
        one, other = numbers[low, left], numbers[high, right]
        both = (one >= 0) & (other >= 0)
        drop = (elevation[high, right] - elevation[low, left])[both]
        ends.append(np.stack([one[both], other[both]]))
        lengths.append(np.sqrt((rows**2 + columns**2) * spacing**2 + drop**2))
    size = int(reached.sum())
    graph = coo_array((np.concatenate(lengths), np.concatenate(ends, axis=1)), shape=(size, size)).tocsr()
    found = float(dijkstra(graph, directed=False, indices=numbers[start])[numbers[stop]])
    return found if np.isfinite(found) else float("nan")


def _between(
    points: Lattice | PointCloud, elevation: Array, release: NDArray[np.bool_], reached: NDArray[np.bool_]
) -> tuple[Cell, Cell]:
    """Find the highest cell of a release and the lowest that was reached."""
    highest = np.argwhere(release & (elevation == elevation[release].max()))
    lowest = np.argwhere(reached & (elevation == elevation[reached].min()))
    pairs = [(tuple(a), tuple(b)) for a in highest for b in lowest[:: max(1, len(lowest) // 100)]]
    return max(pairs, key=lambda pair: _distance(points, *pair))


def _distance(points: Lattice | PointCloud, start: Cell, stop: Cell) -> float:
    """Horizontal distance between two cells, m."""
    if not isinstance(points, Lattice):
        return float(np.hypot(*(points.points[stop] - points.points[start])))
    (j, i), (n, m) = start, stop
    return float(np.hypot(points.x_points[m] - points.x_points[i], points.y_points[n] - points.y_points[j]))


def lifted_share(
    terrain: ElevationModel,
    points: Lattice | PointCloud,
    reached: NDArray[np.bool_],
    max_speed: Array,
    gravity: float,
) -> float:
    """Share of the cells that a flow reached where its largest speed may have lifted it off the bed.

    There ``g_n + k u^2 <= 0``, k the curvature by which friction is loaded, in the direction of steepest
    descent.

    Parameters
    ----------
    terrain : ElevationModel
        The bed.
    points : Lattice or PointCloud
        Its cells; the shape of arrays below is theirs.
    reached : array
        Whether the flow came to a cell.
    max_speed : array
        Largest speed over all time steps, m s-1.
    gravity : float
        m s-2.
    """
    if not reached.any() or terrain.curvature_length is None:
        return 0.0
    if isinstance(points, Lattice):
        x, y = points.x_points, points.y_points
        b_x, b_y = plan_slopes(terrain.corners(edges_of(x, points.dx), edges_of(y, points.dx)), points.dx)
        z_xx, z_xy, z_yy = terrain.hessian(x, y)
    else:
        b_x, b_y = mean_slopes(terrain, points.control_volumes)
        z_xx, z_xy, z_yy = terrain.hessian_at(*points.control_volumes.centroid.T)
    w_squared, steep = 1.0 + b_x * b_x + b_y * b_y, b_x * b_x + b_y * b_y
    along = b_x * (z_xx * b_x + z_xy * b_y) + b_y * (z_xy * b_x + z_yy * b_y)
    curvature = along / np.maximum(steep, 1e-300) / w_squared**1.5
    lifted = gravity / np.sqrt(w_squared) + curvature * max_speed**2 <= 0
    return float(lifted[reached].mean())


def narrow(elevation: Array, max_depth: Array, reached: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Say which cells that a flow reached lie between banks less than four cells apart.

    A bank is a cell whose bed is higher than the surface of the flow at its deepest, the mean slope of the
    ground taken off. It is looked for on both sides across that slope, along the lattice or a diagonal. Cells
    count whose bed is lower than beside them: the bottom of a channel.

    Parameters
    ----------
    elevation : array
        Of the bed, (ny, nx), m; NaN where there is no data, which is no bank.
    max_depth : array
        Largest depth over all time steps, (ny, nx), m.
    reached : array
        Whether the flow came to a cell, (ny, nx).
    """
    from scipy.ndimage import uniform_filter

    known, (ny, nx), far = np.isfinite(elevation), elevation.shape, LEAST_CELLS - 1
    bed = np.where(known, elevation, 0.0)
    weight = uniform_filter(known.astype(float), AROUND)
    north, east = np.gradient(uniform_filter(bed, AROUND) / np.maximum(weight, 1e-9))
    padded = np.pad(np.where(known, bed, -np.inf), far, constant_values=-np.inf)

    def bed_at(n: int, rows: int, columns: int) -> Array:
        """Bed of the cells n steps away in a direction, the slope of the ground taken off."""
        j, i = far + n * rows, far + n * columns
        return np.asarray(padded[j : j + ny, i : i + nx] - n * (rows * north + columns * east))

    def bank(rows: int, columns: int) -> NDArray[np.int64]:
        """Cells to the nearest bank in a direction; many where there is none near."""
        found = np.full((ny, nx), 2 * LEAST_CELLS)
        for n in range(far, 0, -1):
            found[bed_at(n, rows, columns) > bed + max_depth] = n
        return found

    # of directions across the slope, in eighths of a turn from the east
    across = np.rint(np.arctan2(east, -north) / (np.pi / 4)).astype(int) % 4
    confined = np.zeros((ny, nx), bool)
    for eighth, (rows, columns) in enumerate(((0, 1), (1, 1), (1, 0), (1, -1))):
        between = (bank(rows, columns) + bank(-rows, -columns) - 1) * float(np.hypot(rows, columns))
        lowest = (bed_at(1, rows, columns) > bed) & (bed_at(-1, rows, columns) > bed)
        confined |= (across == eighth) & lowest & (between < LEAST_CELLS)
    return confined & reached & known


def narrow_channels(prepared: Prepared, elevation: Array, max_depth: Array) -> Iterator[str]:
    """Say where a run on an elevation model went through a channel that its cells do not show.

    Parameters
    ----------
    prepared : Prepared
        The run.
    elevation : array
        Of the bed, (ny, nx), m.
    max_depth : array
        Largest depth over all time steps, (ny, nx), m.
    """
    from scipy.ndimage import label

    points = prepared.scene.points
    if not isinstance(points, Lattice):
        return
    cells = narrow(elevation, max_depth, max_depth > prepared.threshold)
    numbers, _ = label(cells, np.ones((3, 3)))
    sizes = np.bincount(numbers.ravel())
    sizes[0] = 0
    long = sizes >= LONG
    if not long.any():
        return
    rows, columns = np.nonzero(numbers == sizes.argmax())
    middle = len(rows) // 2
    x, y = points.x_points[columns[middle]], points.y_points[rows[middle]]
    share = sizes[long].sum() / (max_depth > prepared.threshold).sum()
    yield (
        f"{NARROW} {LEAST_CELLS} cells on the flow's way, the longest of {sizes.max()} cells at "
        f"x = {x:.8g} m, y = {y:.8g} m; {percent(share)} of the cells that were reached lie in such: "
        "flow may spill there; take a smaller spacing"
    )


def note(warnings: Iterable[object]) -> str:
    """Say in how many runs the flow went through narrow channels, by their warnings; "" for none."""
    runs = sum(NARROW in str(warning) for warning in warnings)
    return f"; channels narrower than {LEAST_CELLS} cells on the flow's way in {runs}" if runs else ""
