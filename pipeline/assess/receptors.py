"""What reaches receptors: named points, lines and areas, by the cells of a store that they are in."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.path import Path as Outline
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation
from scipy.spatial import Delaunay, KDTree

from pipeline.assess.ensemble import computed
from pipeline.assess.frames import densities, plan_area, pressure, space
from pipeline.scenario.scenario import stored
from pipeline.settings.receptor import Receptor
from pipeline.settings.section import Pair
from pipeline.store.variables import ERODED, STATUS, Status

Array = NDArray[np.float64]

# Steps along a line in spacings: it misses no cell that it crosses over a tenth of its width.
STEP = 0.1
FIELDS = ("max_depth", "max_speed", "arrival_time")


class Cells:
    """The cells of a store, and which of them hold a place: those of the nearest points."""

    def __init__(self, store: xr.Dataset) -> None:
        x, y = xr.broadcast(store["x"], store["y"])
        over = space(store)
        self.points = np.stack([a.transpose(*over).to_numpy().ravel() for a in (x, y)], axis=1)
        # cells on an elevation model are larger on the bed than in plan
        self.spacing = float(np.sqrt(np.min(plan_area(store))))
        self.buildings = store["building"].to_numpy() == 1 if "building" in store.variables else None

    @cached_property
    def _tree(self) -> KDTree:
        return KDTree(self.points)

    def of(self, receptor: Receptor) -> NDArray[np.intp]:
        """Give the cells of a receptor, in the order of the store's points, shape (cells,).

        Of one in or on a building these are the cells around it, where what strikes it flows.
        """
        cells = self._held(receptor)
        if self.buildings is None or not self.buildings.ravel()[cells].any():
            return cells
        return self._around(cells, whole=receptor.point is not None)

    def _around(self, cells: NDArray[np.intp], *, whole: bool) -> NDArray[np.intp]:
        """Put the cells around buildings in place of their own; ``whole`` : around all that they touch."""
        assert self.buildings is not None
        own = np.zeros_like(self.buildings)
        own.ravel()[cells] = True
        found = np.zeros_like(own)
        if not whole:
            found = (self._grown(own & self.buildings) | own) & ~self.buildings
        if not found.any():
            touched = before = own & self.buildings
            while (touched := self._grown(before) & self.buildings).sum() > before.sum():
                before = touched
            found = self._grown(touched) & ~self.buildings
        return np.flatnonzero(found)

    def _grown(self, cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Add the cells beside some; on a cloud those whose points are neighbours in a triangulation."""
        if cells.ndim == 2:
            return np.asarray(binary_dilation(cells, np.ones((3, 3), bool)))
        first, beside = self._beside
        found = cells.copy()
        for i in np.flatnonzero(cells):
            found[beside[first[i] : first[i + 1]]] = True
        return found

    @cached_property
    def _beside(self) -> tuple[NDArray[np.intc], NDArray[np.intc]]:
        first, beside = Delaunay(self.points).vertex_neighbor_vertices
        return first, beside

    def _held(self, receptor: Receptor) -> NDArray[np.intp]:
        if receptor.point is not None:
            return self._nearest(np.array([receptor.point]))
        if receptor.line is not None:
            return self._nearest(self._inside(self._along(receptor.line)))
        assert receptor.polygon is not None
        corners = (*receptor.polygon, receptor.polygon[0])
        inside = Outline(np.array(corners)).contains_points(self.points)
        edge = self._nearest(self._inside(self._along(corners)))
        return np.union1d(np.flatnonzero(inside), edge)

    def _inside(self, places: Array) -> Array:
        """Leave out the places of a line beyond the outer cells; none, where all of them are."""
        half = self.spacing / 2
        low, high = self.points.min(axis=0) - half, self.points.max(axis=0) + half
        inside = ((low <= places) & (places <= high)).all(axis=1)
        return places[inside] if inside.any() else places

    def _along(self, corners: tuple[Pair, ...]) -> Array:
        """Points along a line, shape (points, 2), m."""
        pieces = []
        for start, end in zip(np.array(corners[:-1]), np.array(corners[1:]), strict=True):
            count = int(np.hypot(*(end - start)) / (STEP * self.spacing)) + 2
            pieces.append(np.linspace(start, end, count))
        return np.concatenate(pieces)

    def _nearest(self, places: Array) -> NDArray[np.intp]:
        _, index = self._tree.query(places)
        return np.unique(index)


def reached(store: xr.Dataset) -> pd.DataFrame:
    """Table what reaches each receptor of a scenario in each of its runs.

    Parameters
    ----------
    store : Dataset
        The scenario's store, with the fields ``max_depth``, ``max_speed`` and ``arrival_time``.

    Returns
    -------
    DataFrame
        A row for each receptor and run: ``scenario``, ``run``, ``status``, ``receptor``, ``reached``,
        ``max_depth`` (m), ``max_speed`` (m s-1), ``max_pressure`` (dynamic pressure, density times speed
        squared, kPa), ``arrival_time`` (s). The largest of its cells, and the first arrival. Where the store
        has them ``erosion_depth`` (m, at least 0), the largest of its cells, and ``bed_change`` (m, below 0
        where the ground has fallen), the mean over their area in plan. What was not computed is missing.
        Empty where the scenario has no receptors.

    Raises
    ------
    ValueError
        If the scenario has receptors and the store lacks a field.
    """
    said = stored(store.attrs)
    receptors, density = said.places, densities(store)
    missing = [name for name in FIELDS if name not in store]
    if receptors and missing:
        title = store.attrs["title"]
        raise ValueError(f"{title}: receptors need {', '.join(missing)}, which output.fields leaves out")
    states = store[STATUS.name].to_numpy()
    known = computed(store).to_numpy()
    cells = Cells(store) if receptors else None
    eroded = [name for name in ERODED if name in store]
    tables = []
    for receptor in receptors:
        assert cells is not None
        at = xr.DataArray(cells.of(receptor), dims="cell")
        held = {name: _over(store[name], store, at) for name in FIELDS}
        largest = {name: np.where(known, held[name].max("cell"), np.nan) for name in FIELDS[:2]}
        arrival = held["arrival_time"].min("cell").to_numpy()
        speed = largest["max_speed"]
        tables.append(
            pd.DataFrame(
                {
                    "scenario": str(store.attrs["title"]),
                    "run": store["run"].to_numpy(),
                    "status": [Status(s).words for s in states],
                    "receptor": receptor.name,
                    "reached": pd.array(np.isfinite(arrival), "boolean"),
                    **largest,
                    "max_pressure": pressure(speed, density),
                    "arrival_time": np.where(known, arrival, np.nan),
                    **{name: np.where(known, _eroded(name, store, at), np.nan) for name in eroded},
                }
            )
        )
        tables[-1].loc[~known, "reached"] = pd.NA
    columns = [
        "scenario",
        "run",
        "status",
        "receptor",
        "reached",
        *FIELDS[:2],
        "max_pressure",
        FIELDS[2],
        *eroded,
    ]
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=columns)


def _eroded(name: str, store: xr.Dataset, at: xr.DataArray) -> Array:
    """Depth of erosion, or change of the ground, at the cells of a receptor in each run, shape (runs,), m."""
    held = _over(store[name], store, at)
    if name == "erosion_depth":
        return np.asarray(held.max("cell"))
    area = np.broadcast_to(plan_area(store), [store.sizes[d] for d in space(store)]).ravel()[at.to_numpy()]
    return np.asarray(held.weighted(xr.DataArray(area, dims="cell")).mean("cell"))


def _over(field: xr.DataArray, store: xr.Dataset, at: xr.DataArray) -> xr.DataArray:
    """Give a field at some cells, shape (runs, cells)."""
    over = space(store)
    places = np.unravel_index(at.to_numpy(), [store.sizes[d] for d in over])
    index = {d: xr.DataArray(place, dims="cell") for d, place in zip(over, places, strict=True)}
    return field.isel(index).transpose("run", "cell").astype(np.float64)
