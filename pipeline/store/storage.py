"""Places that are URLs: what is done otherwise there than in a folder of this machine."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from zarr.storage import FsspecStore

# another process may have written since a folder was listed
OPTIONS = {"use_listings_cache": False}


def located(text: str) -> Path:
    """Give the path of a place; that of a URL does what paths do, by fsspec.

    Raises
    ------
    ImportError
        If what speaks to the URL is not installed.
    ValueError
        If nothing is known to.
    """
    if "://" not in text:
        return Path(text)
    found: Any = import_module("upath").UPath(text, **OPTIONS)
    # whether it can be spoken to is seen no sooner
    assert found.fs is not None
    return cast(Path, found)


def is_url(path: Path) -> bool:
    """Whether a path is that of a URL."""
    return not isinstance(path, Path)


def at_hand(path: Path) -> Path:
    """Give where pictures, maps and tables go: of a URL to their name in the folder one is in."""
    return Path(path.name) if is_url(path) else path


def store_of(path: Path) -> Path | FsspecStore:
    """Give what zarr opens."""
    if not is_url(path):
        return path
    from zarr.storage import FsspecStore

    return FsspecStore.from_url(str(path), storage_options=OPTIONS)


def is_made(path: Path) -> bool:
    """Whether there is a store: at a URL its root is written last of all, and makes it one."""
    return (path / "zarr.json").exists() if is_url(path) else path.exists()


def put(path: Path, data: bytes) -> None:
    """Write a file whole or not at all.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    if is_url(path):
        with reached():
            path.write_bytes(data)
        return
    with whole(path) as aside:
        aside.write_bytes(data)


@contextmanager
def whole(path: Path, ending: str = "") -> Iterator[Path]:
    """Give the name that a file of a folder has until it is whole; then it replaces what was there.

    ``ending`` is for writers that look at the end of a name; what is killed leaves a file that is not swept.
    """
    aside = path.with_name(f".{path.name}.{os.getpid()}.partial{ending}")
    try:
        yield aside
        aside.replace(path)
    finally:
        aside.unlink(missing_ok=True)


def create(path: Path, data: bytes) -> None:
    """Write an object of a URL that is not there.

    Raises
    ------
    FileExistsError
        If it is there; of several processes at once, one succeeds.
    """
    at: Any = path
    with reached():
        at.fs.pipe_file(at.path, data, mode="create")


def upload(folder: Path, path: Path) -> None:
    """Move a store of this machine to a URL; its root comes last, and only where none is."""
    at: Any = path
    files = {f"{at.path}/{file.relative_to(folder).as_posix()}": file for file in folder.rglob("*")}
    held = {name: file.read_bytes() for name, file in files.items() if file.is_file()}
    shutil.rmtree(folder)
    root = held.pop(f"{at.path}/zarr.json")
    with reached():
        at.fs.pipe(held)
    create(path / "zarr.json", root)


def remove(path: Path) -> None:
    """Remove a folder with all that is in it, the root of a store first; nothing where there is none."""
    if not is_url(path):
        shutil.rmtree(path, ignore_errors=True)
        return
    at: Any = path
    (path / "zarr.json").unlink(missing_ok=True)
    if path.exists():
        at.fs.rm(at.path, recursive=True)


@contextmanager
def reached() -> Iterator[None]:
    """Make an OSError of a URL that does not answer."""
    try:
        yield
    except unreachable() as error:
        raise OSError(str(error)) from error


def unreachable() -> tuple[type[Exception], ...]:
    """Errors of URLs that do not answer and are no OSError."""
    try:
        found: type[Exception] = import_module("botocore.exceptions").BotoCoreError
    except ImportError:
        return ()
    return (found,)
