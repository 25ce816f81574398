"""The film of a run as a file of its own: GIF, WebP, or MP4."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from PIL import Image

from pipeline.assess.ensemble import ensemble
from pipeline.hazard.map_files import ground
from pipeline.hazard.release_outlines import release_outlines
from pipeline.report.chapter import median_run
from pipeline.report.figures import SHOWN_MILLISECONDS, encoded, film
from pipeline.scenario.scenario import stored

ENDINGS = (".gif", ".webp", ".mp4")
ENCODER = "ffmpeg"


def write_film(store: xr.Dataset, run: int | None, path: Path) -> Path:
    """Write the film of a run, with scale, time, releases and receptors.

    Parameters
    ----------
    store : Dataset
        A scenario's store.
    run : int or None
        Position of the run; by default the computed one of median run-out.
    path : Path
        File that is written; its ending says of what kind.

    Raises
    ------
    ValueError
        If the run is not there, its frames were not kept, the ending is not known, or MP4 is asked for
        without ffmpeg.
    OSError
        If the file cannot be written.
    """
    if path.suffix not in ENDINGS:
        raise ValueError(f"expected a file ending in {', '.join(ENDINGS)}, found '{path}'")
    shown = median_run(store) if run is None else run
    if shown is None or shown >= store.sizes["run"]:
        raise ValueError(f"there is no run {run}: the store holds {store.sizes['run']}, counted from 0")
    marks = _marks(store)
    pictures = film(store, shown, ground(marks), marks)
    if pictures is None:
        raise ValueError(f"run {shown} has no frames: it was not done, or its depth was not kept")
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".mp4":
        _encode(pictures, path)
    else:
        path.write_bytes(encoded(pictures, path.suffix[1:]))
    return path


def _marks(store: xr.Dataset) -> xr.Dataset:
    """Give the places of the points with what hazard maps say of where they lie."""
    settings = stored(store.attrs)
    about = {
        "receptors": json.dumps([each.model_dump(mode="json") for each in settings.places]),
        "releases": json.dumps(release_outlines(store)),
    }
    if settings.georeference is not None:
        about["georeference"] = settings.georeference.model_dump_json()
    if "crs" in store.attrs:
        about["crs"] = str(store.attrs["crs"])
    return ensemble(store).assign_attrs(about)


def _encode(pictures: Sequence[Image.Image], path: Path) -> None:
    """Write MP4 by ffmpeg, which players and slides take."""
    encoder = shutil.which(ENCODER)
    if encoder is None:
        raise ValueError(f"{path.name} needs {ENCODER}, which is not installed; .gif and .webp do not")
    # the colours of MP4 need even numbers of pixels; the last picture stays a while
    frames = [np.asarray(each)[: each.height // 2 * 2, : each.width // 2 * 2] for each in pictures]
    frames += [frames[-1]] * 8
    height, width, _ = frames[0].shape
    command = [
        *(encoder, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"),
        *("-s", f"{width}x{height}", "-r", f"{1000 / SHOWN_MILLISECONDS:g}", "-i", "-"),
        *("-c:v", "libx264", "-pix_fmt", "yuv420p", "-movflags", "+faststart", str(path)),
    ]
    done = subprocess.run(command, input=b"".join(each.tobytes() for each in frames), capture_output=True)
    if done.returncode:
        raise OSError(done.returncode, done.stderr.decode(errors="replace").strip(), str(path))
