"""Storage of results: what a folder of this machine and the objects of a URL do each in its own way."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Protocol

from pipeline.store import objects
from pipeline.store.folder import Folder
from pipeline.store.object_store import ObjectStore

SCHEME = re.compile("[A-Za-z][A-Za-z0-9+.-]+")

if TYPE_CHECKING:
    from zarr.storage import FsspecStore


class Location(Protocol):
    """What a path and a URL have in common; it pickles, and ``str()`` gives it as it is written."""

    @property
    def name(self) -> str:
        """Last part."""

    @property
    def stem(self) -> str:
        """Last part without its ending."""

    @property
    def suffix(self) -> str:
        """Ending of the last part, with its dot."""

    @property
    def parent(self) -> Location:
        """What it lies in."""

    def __hash__(self) -> int: ...

    def __truediv__(self, name: str, /) -> Location: ...

    def with_name(self, name: str, /) -> Location:
        """Give the location of another last part."""

    def with_suffix(self, suffix: str, /) -> Location:
        """Give the location of another ending."""

    def resolve(self) -> Location:
        """Give the location without dots and links."""

    def exists(self) -> bool:
        """Whether there is something."""

    def iterdir(self) -> Iterator[Location]:
        """Go through what is directly below."""

    def glob(self, pattern: str, /) -> Iterator[Location]:
        """Go through what matches below."""

    def mkdir(self, *, parents: bool = False, exist_ok: bool = False) -> None:
        """Make a folder; at a URL there is nothing to make."""

    def open(self, mode: str, /) -> IO[Any]:
        """Open a file."""

    def read_bytes(self) -> bytes:
        """Read a file."""

    def write_bytes(self, data: bytes, /) -> int:
        """Write a file."""

    def unlink(self, missing_ok: bool = False) -> None:
        """Remove a file."""


class Storage(Protocol):
    """What is done at one location."""

    def absolute(self) -> Location:
        """Give the location by a name that holds for every process."""

    def at_hand(self) -> Path:
        """Give where pictures, maps and tables go, which are written to a folder."""

    def log(self) -> Path | None:
        """Give the log of a place, which a line a run is appended to; None where nothing can be appended."""

    def to_zarr(self) -> Path | FsspecStore:
        """Give what zarr opens."""

    def is_made(self) -> bool:
        """Whether there is a store."""

    def put(self, data: bytes) -> None:
        """Write a file whole or not at all.

        Raises
        ------
        OSError
            If it cannot be written.
        """

    def aside(self) -> Path:
        """Make a folder of this machine in which a store is made before it is published."""

    def publish(self, aside: Path, *, replace: bool) -> None:
        """Move a store here from the folder it was made in; it appears whole or not at all.

        Without ``replace`` one that another process has made meanwhile stays.
        """

    def remove(self) -> None:
        """Remove a folder with all that is in it; nothing where there is none."""

    def remove_if_empty(self) -> None:
        """Remove a folder that has nothing in it."""

    def sweep(self) -> int:
        """Remove what killed writers left in a place nobody else writes to; gives how many things."""

    def held(self) -> AbstractContextManager[None]:
        """Hold a place, made where it is missing, as its only driver.

        Raises
        ------
        TakenError
            If another process holds it.
        OSError
            If the place cannot be made or written.
        """

    def held_in_part(self, index: int, count: int, scenarios: str) -> AbstractContextManager[bool]:
        """Hold part ``index`` of ``count``, from 1; gives whether it is known that nobody else was there.

        Raises
        ------
        TakenError
            If a driver of the whole holds the place, parts of something else, or another process this part.
        OSError
            If the place cannot be made or written.
        """

    def holder(self) -> str | None:
        """Say which process holds a place; None where none does. Writes nothing."""


def storage_of(location: Location) -> Storage:
    """Give the storage of a location."""
    return Folder(location) if isinstance(location, Path) else ObjectStore(location)


def located(text: str) -> Location:
    """Give the location of a folder or of a URL.

    Raises
    ------
    ImportError
        If what speaks to the URL is not installed.
    ValueError
        If it is no whole URL, or nothing is known that speaks to it. The message says what to write.
    """
    scheme, colon, rest = text.partition(":")
    # a name of a folder may hold a colon, but hardly begin with a word, a colon and a slash
    if not (colon and rest.startswith("/") and SCHEME.fullmatch(scheme)):
        return Path(text)
    path = rest.lstrip("/")
    if scheme == "file":
        return Path("/", path)
    if not rest.startswith("//") or not path:
        raise ValueError(f"{text}: expected a URL as {scheme}://{path or 'bucket/path'}, or a folder")
    return objects.located(text)


def store_of(location: Location) -> Path | FsspecStore:
    """Give what zarr opens."""
    return storage_of(location).to_zarr()


def put(location: Location, data: bytes) -> None:
    """Write a file whole or not at all.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    storage_of(location).put(data)


def is_made(location: Location) -> bool:
    """Whether there is a store."""
    return storage_of(location).is_made()


def at_hand(location: Location) -> Path:
    """Give where pictures, maps and tables go: of a URL to their name in the folder one is in."""
    return storage_of(location).at_hand()
