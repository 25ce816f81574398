"""What the page says of one scenario, or of all together."""

from __future__ import annotations

import base64
import re
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
import xarray as xr
from PIL import Image

from pipeline.assess.ensemble import computed
from pipeline.assess.georeference import Frame
from pipeline.assess.tables import finest
from pipeline.emulation.emulate import Emulated
from pipeline.emulation.errors import NotEmulatedError
from pipeline.gis.layer import Layer
from pipeline.hazard.layers import layers
from pipeline.hazard.location import draw_location
from pipeline.hazard.map_files import ground
from pipeline.hazard.pictures import draw
from pipeline.hazard.place_maps import WHOLE
from pipeline.report.explorer import explorer
from pipeline.report.figures import animation, hydrographs, runout_curve
from pipeline.report.findings import findings
from pipeline.report.palette import with_palette
from pipeline.report.section import section
from pipeline.report.tables.emulated import emulated_tables
from pipeline.report.tables.inputs import inputs, method
from pipeline.report.tables.receptors import receptor_periods, receptors, sheets
from pipeline.report.tables.runs import failures, origin, quantiles, sections, volume_ledger, what_matters
from pipeline.report.tables.spacing import one_spacing, spacing_table
from pipeline.report.tables.table import Table
from pipeline.scenario.scenario import stored
from pipeline.store.place import indices_path, store_path
from pipeline.store.storage import Location

# shown at once; other maps fold out
SHOWN = (
    *("hazard_level", "intensity", "arrival_share", "arrival_rate"),
    *("earliest_arrival_time", "arrival_time"),
)
PALETTE = 256
# breadth over height of pictures of which three go on a sheet
FLAT = 1.6
# in the order they are shown; one that has nothing to tell gives None
LEVELLED: tuple[Callable[[xr.Dataset, xr.Dataset | None], Table | None], ...] = (
    *(receptors, receptor_periods, quantiles),
)
TABLES: tuple[Callable[[xr.Dataset], Table | None], ...] = (sections, volume_ledger, failures)
FOLDED = ("share", "value", "class", "difference")


@dataclass(frozen=True)
class Picture:
    """A picture in the page itself; of one that is flat three go on a sheet of paper."""

    words: str
    uri: str
    caption: str = ""
    is_flat: bool = False


@dataclass(frozen=True)
class Chapter:
    """What the page says of one scenario, or of all together."""

    anchor: str
    name: str
    description: str
    runs: str
    maps: Sequence[Picture]
    others: Sequence[Picture] = ()
    findings: Sequence[str] = ()
    location: Picture | None = None
    explorer: str | None = None
    explorer_steps: str = "0.01 m and 0.1 m/s"
    has_periods: bool = False
    section: Picture | None = None
    curve: Picture | None = None
    hydrographs: Picture | None = None
    motion: Picture | None = None
    tables: Sequence[Table] = ()
    sheets: Sequence[Table] = ()
    convergence: Table | str = ""
    inputs: Table | None = None
    method: Sequence[str] = ()
    origin: Table | None = None
    text: str = ""


def of_scenario(
    out: Location,
    store: xr.Dataset,
    found: xr.Dataset,
    run: int | None,
    emulated: Emulated | NotEmulatedError | None = None,
) -> Chapter:
    """Put together the chapter of a scenario.

    Parameters
    ----------
    out : Location
        The place.
    store : Dataset
        The scenario's store.
    found : Dataset
        Its hazard maps.
    run : int or None
        Position of the run in motion; by default that of median run-out.
    emulated : Emulated or NotEmulatedError, optional
        What was emulated of it, or why it cannot be.
    """
    name, settings = str(store.attrs["title"]), stored(store.attrs)
    placed = ground(found)
    shown = median_run(store) if run is None else run
    motion = None
    if shown is not None and shown < store.sizes["run"]:
        motion = animation(store, shown, placed, found)
    curve, cut = runout_curve(store), section(store, found, settings.hazard)
    discharge = hydrographs(store)
    first, others = _maps(found, placed)
    fine = finest(store_path(out, name), store)
    try:
        tables = [make(store, fine) for make in LEVELLED]
    finally:
        if fine is not None:
            fine.close()
    tables += [make(store) for make in TABLES]
    tables[1:1] = [what_matters(indices_path(out), name), *emulated_tables(emulated)]
    convergence = spacing_table(out, store)
    if isinstance(emulated, Emulated) and emulated.maps is not None:
        first += _emulated(emulated.maps)
    return Chapter(
        anchor=anchor_of(name),
        name=name,
        description=str(store.attrs["comment"]),
        runs=str(found.attrs["comment"]),
        maps=first,
        others=others,
        findings=findings(store, found, indices_path(out)),
        location=_location(found, placed),
        explorer=_script(explorer(store, found, placed, settings.hazard)),
        has_periods="return_period" in store.variables,
        section=None if cut is None else Picture("longitudinal section", _uri(cut, "png"), SECTION),
        curve=None if curve is None else Picture("run-out", _uri(curve, "png")),
        hydrographs=None if discharge is None else Picture("discharge at sections", _uri(discharge, "png")),
        motion=None if motion is None else Picture(f"run {shown} in motion", _uri(motion, "webp")),
        tables=[table for table in tables if table is not None],
        sheets=sheets(store),
        convergence=convergence or one_spacing(store),
        inputs=inputs(store),
        method=method(store),
        origin=origin(store),
        text=str(store.attrs["scenario"]),
    )


SECTION = (
    "Depths are the largest across the section. Their quantiles are over the runs at each place, so that the "
    "envelope is of no single run. The energy height adds the head of the largest speed, v²/2g, which need "
    "not be of the moment of the largest depth."
)


def of_all(found: xr.Dataset) -> Chapter:
    """Put together the chapter of all scenarios."""
    placed = ground(found)
    first, others = _maps(found, placed)
    return Chapter(
        anchor=anchor_of(WHOLE),
        name=WHOLE,
        description=f"All runs of {found.attrs['scenarios']}",
        runs=str(found.attrs["comment"]),
        maps=first,
        others=others,
    )


def _maps(found: xr.Dataset, frame: Frame | None) -> tuple[list[Picture], list[Picture]]:
    """Draw the maps: those that say most, and the others."""
    held = {layer.name: layer for layer in layers(found)}
    wanted = [name for name in SHOWN[:2] if name in held]
    wanted += [name for name, layer in held.items() if layer.threshold is not None][:1]
    wanted += [name for name, layer in held.items() if name.startswith("depth_quantile")][-1:]
    wanted += [name for name in SHOWN[2:] if name in held]
    others = [name for name in held if name not in wanted and held[name].kind in FOLDED]
    with tempfile.TemporaryDirectory() as folder:
        pictures = [picture(held[name], found, frame, Path(folder)) for name in (*wanted, *others)]
    return pictures[: len(wanted)], pictures[len(wanted) :]


def _emulated(found: xr.Dataset) -> list[Picture]:
    """Draw emulated maps."""
    placed = ground(found)
    with tempfile.TemporaryDirectory() as folder:
        return [picture(layer, found, placed, Path(folder)) for layer in layers(found)]


def picture(layer: Layer, found: xr.Dataset, frame: Frame | None, folder: Path) -> Picture:
    """Draw a map for the page; the folder is for what is made on the way."""
    path = draw(layer, found, frame, folder / f"{layer.name}.png")
    return _shown(path, f"{layer.title}: {found.attrs['comment']}")


def _shown(path: Path, words: str) -> Picture:
    with Image.open(path) as image:
        is_flat = image.width > FLAT * image.height
    return Picture(words, _uri(_small(path), "png"), is_flat=is_flat)


def _small(path: Path) -> bytes:
    """Give a picture with a palette."""
    held = BytesIO()
    with Image.open(path) as picture:
        (reduced,) = with_palette([picture], PALETTE)
    reduced.save(held, "PNG", optimize=True)
    return held.getvalue()


def _location(found: xr.Dataset, frame: Frame | None) -> Picture:
    with tempfile.TemporaryDirectory() as folder:
        path = draw_location(found, frame, Path(folder) / "location.png")
        return _shown(path, "location of releases and receptors")


def _script(data: str | None) -> str | None:
    """Make JSON safe within a script of a page: nothing there can end it."""
    return None if data is None else data.replace("<", "\\u003c").replace("&", "\\u0026")


def median_run(store: xr.Dataset) -> int | None:
    """Give the position of the computed run of median run-out; of any computed one where none has one."""
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


def anchor_of(name: str) -> str:
    """Give what links to a chapter name it by."""
    return "scenario-" + re.sub(r"[^A-Za-z0-9._-]", "-", name)
