"""One page about a place: scenarios, maps, run-out, ledger, failures and versions, whole in itself."""

from __future__ import annotations

import base64
import logging
import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from jinja2 import Environment, PackageLoader, StrictUndefined

from pipeline.assess.ensemble import NotTogetherError, computed
from pipeline.assess.georeference import Frame
from pipeline.hazard.layers import Layer, layers
from pipeline.hazard.map_files import ground
from pipeline.hazard.mapping import WHOLE, of_place
from pipeline.hazard.pictures import draw
from pipeline.report.figures import animation, hydrographs, runout_curve
from pipeline.report.tables import TABLES, Table, what_matters
from pipeline.store import storage
from pipeline.store.place import indices_path, store_path, store_paths
from pipeline.store.storage import Location
from pipeline.store.zarr_store import open_store

TEMPLATE = "report.html"
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Picture:
    """A picture in the page itself."""

    words: str
    uri: str


@dataclass(frozen=True)
class Chapter:
    """What the page says of one scenario, or of all together."""

    anchor: str
    name: str
    description: str
    runs: str
    maps: Sequence[Picture]
    others: Sequence[Picture] = ()
    curve: Picture | None = None
    motion: Picture | None = None
    hydrographs: Picture | None = None
    tables: Sequence[Table] = ()
    text: str = ""


def write_report(out: Location, to: Location, run: int | None = None) -> Location:
    """Write the page about a place.

    Parameters
    ----------
    out : Location
        The place.
    to : Location
        The page; one that was there is replaced.
    run : int, optional
        Position of the run that is shown in motion; by default, of each scenario, the computed one whose
        run-out is the median.

    Returns
    -------
    Location
        The page.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    ValueError
        If no scenario has such a run, or a scenario is not known here.
    OSError
        If the page cannot be written.
    """
    if run is not None and not any(_has_frames(path, run) for path in store_paths(out)):
        raise ValueError(f"no scenario has frames of a run {run}")
    chapters: list[Chapter] = []
    note = ""
    try:
        for name, found in of_place(out, {}):
            chapters.append(_whole(found) if name == WHOLE else _scenario(out, name, found, run))
    except NotTogetherError as error:
        note = f"There is no map over all scenarios: {error}."
    environment = Environment(
        loader=PackageLoader("pipeline.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    page = environment.get_template(TEMPLATE).render(chapters=chapters, note=note, place=out.resolve().name)
    storage.put(to, page.encode())
    return to


def _has_frames(path: Location, run: int) -> bool:
    with open_store(path) as store:
        return "depth" in store and run < store.sizes["run"]


def _scenario(out: Location, name: str, found: xr.Dataset, run: int | None) -> Chapter:
    with open_store(store_path(out, name)) as store:
        _log.info("page of %s", name)
        placed = ground(found)
        shown = _median(store) if run is None else run
        motion = None
        if shown is not None and shown < store.sizes["run"]:
            motion = animation(store, shown, placed)
        curve, discharge = runout_curve(store), hydrographs(store)
        first, others = _maps(found, placed)
        tables = [*(make(store) for make in TABLES)]
        tables.insert(1, what_matters(indices_path(out), name))
        return Chapter(
            anchor=_anchor(name),
            name=name,
            description=str(store.attrs["comment"]),
            runs=str(found.attrs["comment"]),
            maps=first,
            others=others,
            curve=None if curve is None else Picture("run-out", _uri(curve, "png")),
            motion=None if motion is None else Picture(f"run {shown} in motion", _uri(motion, "webp")),
            hydrographs=None
            if discharge is None
            else Picture("discharge at sections", _uri(discharge, "png")),
            tables=[table for table in tables if table is not None],
            text=str(store.attrs["scenario"]),
        )


def _whole(found: xr.Dataset) -> Chapter:
    first, others = _maps(found, ground(found))
    return Chapter(
        anchor=_anchor(WHOLE),
        name=WHOLE,
        description=f"All runs of {found.attrs['scenarios']}",
        runs=str(found.attrs["comment"]),
        maps=first,
        others=others,
    )


def _maps(found: xr.Dataset, frame: Frame | None) -> tuple[list[Picture], list[Picture]]:
    """Draw the maps: those that say most, and the others."""
    held = {layer.name: layer for layer in layers(found)}
    wanted: list[str] = [name for name in ("hazard_level", "intensity") if name in held]
    wanted += [name for name in held if name.startswith("intensity_")]
    wanted += [name for name, layer in held.items() if layer.threshold is not None][:1]
    wanted += [name for name in ("arrival_rate", "arrival_time") if name in held]
    others = [name for name in held if name not in wanted and held[name].kind == "share"]
    with tempfile.TemporaryDirectory() as folder:
        pictures = [_picture(held[name], found, frame, Path(folder)) for name in (*wanted, *others)]
    return pictures[: len(wanted)], pictures[len(wanted) :]


def _picture(layer: Layer, found: xr.Dataset, frame: Frame | None, folder: Path) -> Picture:
    path = draw(layer, found, frame, folder / f"{layer.name}.png")
    return Picture(f"{layer.title}: {found.attrs['comment']}", _uri(path.read_bytes(), "png"))


def _median(store: xr.Dataset) -> int | None:
    """Position of the computed run whose run-out is the median; of any computed one where none has one."""
    known = np.flatnonzero(computed(store))
    if not known.size:
        return None
    reach = store["runout_distance"].to_numpy()[known]
    deposits = np.flatnonzero(~np.isnan(reach))
    if not deposits.size:
        return int(known[0])
    return int(known[deposits[np.argsort(reach[deposits], kind="stable")[(len(deposits) - 1) // 2]]])


def _uri(content: bytes, kind: str) -> str:
    return f"data:image/{kind};base64,{base64.b64encode(content).decode()}"


def _anchor(name: str) -> str:
    return "scenario-" + re.sub(r"[^A-Za-z0-9._-]", "-", name)
