"""Paths of places, of stores, and of what is written."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.errors import OptionError

if TYPE_CHECKING:
    from pipeline.results import Results
    from pipeline.store.storage import Location

    Anywhere = str | PathLike[str] | Location
    Place = Anywhere | Results


def located_anywhere(path: Anywhere) -> Location:
    """Give the path of a folder or of a URL."""
    from pipeline.store.storage import located

    if not isinstance(path, str):
        # of a folder, or what stands for a URL
        return Path(path) if isinstance(path, PathLike) else path
    try:
        return located(path)
    except (ImportError, ValueError) as error:
        raise OptionError("", str(error)) from None


def writable(path: Anywhere) -> Location:
    """Give the path of a file, its folder made where it is missing."""
    found = located_anywhere(path)
    if isinstance(found, Path):
        found.parent.mkdir(parents=True, exist_ok=True)
    return found


def place_of(out: Place) -> Location:
    """Give the path of a place, or of results."""
    # results know their place; to ask for their type would import xarray
    place: Any = getattr(out, "place", out)
    return find_place(place)


def find_place(path: Anywhere) -> Location:
    """Give the path of a place, a folder or a URL, whether it is there or not.

    Raises
    ------
    OptionError
        If it is the store of a scenario, a file, or a URL that is not written as one.
    """
    from pipeline.store.place import not_a_place

    found = located_anywhere(path)
    if _is_store(found):
        raise OptionError("", not_a_place(found))
    if isinstance(found, Path) and found.is_file():
        raise OptionError("", f"{found}: expected a folder, found a file")
    return found


def find_store(path: Anywhere) -> Location:
    """Give the path of a store.

    Raises
    ------
    OptionError
        If it is a place of several.
    FileNotFoundError
        If there is none.
    """
    from pipeline.store.place import not_a_store

    found = located_anywhere(path)
    if not _is_store(found):
        raise FileNotFoundError(not_a_store(found))
    return found


def _is_store(path: Location) -> bool:
    return path.suffix == ".zarr" and (path / "zarr.json").exists()
