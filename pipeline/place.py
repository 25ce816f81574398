"""The place results go to: what lies where in it, and its lock, held by one driver at a time."""

from __future__ import annotations

import fcntl
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class PlaceInUseError(Exception):
    """Another driver holds the place; ``str()`` says which."""


def store_path(out: Path, name: str) -> Path:
    """Store of a scenario."""
    return out / f"{name}.zarr"


def summary_path(out: Path) -> Path:
    """Table over all scenarios of the place."""
    return out / "summary.csv"


@contextmanager
def held(out: Path) -> Iterator[None]:
    """Hold a place, made where it is missing, as its only driver.

    The system lets go of the lock when the process ends, however it ends. The file stays: removing it would
    let two processes hold locks on two files of one name.

    Raises
    ------
    PlaceInUseError
        If another process holds it.
    OSError
        If the place cannot be made or written.
    """
    out.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(out / ".lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    with os.fdopen(descriptor, "r+") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = lock.read().strip() or "another process"
            raise PlaceInUseError(f"{out} is in use by {holder}") from None
        lock.truncate()
        lock.write(f"process {os.getpid()} on {socket.gethostname()}")
        lock.flush()
        try:
            yield
        finally:
            lock.seek(0)
            lock.truncate()
