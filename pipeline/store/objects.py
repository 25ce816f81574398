"""Objects of a URL: written, created by one process alone, moved there and removed."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipeline.store.storage import Location

# another process may have written since a folder was listed
OPTIONS = {"use_listings_cache": False}


def located(text: str) -> Location:
    """Give the location of a URL.

    Raises
    ------
    ImportError
        If what speaks to the URL is not installed.
    ValueError
        If nothing is known that does.
    """
    try:
        found: Any = import_module("upath").UPath(text, **OPTIONS)
        # whether it can be spoken to is seen no sooner
        assert found.fs is not None
    except ImportError as error:
        raise ImportError(f"{text}: {error}; for S3: pip install 'lmls[s3]'") from error
    except ValueError as error:
        raise ValueError(f"{text}: expected a URL as s3://bucket/path, or a folder: {error}") from error
    location: Location = found
    return location


def put(path: Location, data: bytes) -> None:
    """Write an object, which appears whole or not at all.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    with reached():
        path.write_bytes(data)


def create(path: Location, data: bytes) -> None:
    """Write an object that is not there.

    Raises
    ------
    FileExistsError
        If it is there; of several processes at once, one succeeds.
    """
    at: Any = path
    with reached():
        at.fs.pipe_file(at.path, data, mode="create")


def upload(folder: Path, path: Location) -> None:
    """Move a store of this machine to a URL; its root comes last, and only where none is.

    Raises
    ------
    FileExistsError
        If a root is there.
    """
    at: Any = path
    files = {f"{at.path}/{file.relative_to(folder).as_posix()}": file for file in folder.rglob("*")}
    held = {name: file.read_bytes() for name, file in files.items() if file.is_file()}
    shutil.rmtree(folder)
    root = held.pop(f"{at.path}/zarr.json")
    with reached():
        at.fs.pipe(held)
    create(path / "zarr.json", root)


def remove(path: Location) -> None:
    """Remove all objects below a URL, the root of a store first; nothing where there are none."""
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
