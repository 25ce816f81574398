"""The place results go to: what lies where in it, and its lock, held by one driver at a time."""

from __future__ import annotations

import fcntl
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic, sleep

# A look at the lock holds it for a moment; a driver waits that long before it believes the place in use.
LOOK_SECONDS = 0.5


class PlaceInUseError(Exception):
    """Another driver holds the place; ``str()`` says which."""


def store_path(out: Path, name: str) -> Path:
    """Store of a scenario."""
    return out / f"{name}.zarr"


def store_paths(out: Path) -> list[Path]:
    """List the stores of a place.

    Raises
    ------
    FileNotFoundError
        If there is none.
    """
    paths = sorted(path for path in out.glob("*.zarr") if not path.name.startswith("."))
    if not paths:
        raise FileNotFoundError(f"no results in {out}")
    return paths


def checkpoint_path(out: Path, name: str) -> Path:
    """Folder of the checkpoints of a scenario's runs."""
    return out / f".{name}.checkpoints"


def summary_path(out: Path) -> Path:
    """Table over all scenarios of the place."""
    return out / "summary.csv"


def _lock_path(out: Path) -> Path:
    return out / ".lock"


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
    descriptor = os.open(_lock_path(out), os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    with os.fdopen(descriptor, "r+") as lock:
        end = monotonic() + LOOK_SECONDS
        while not _locked(descriptor, fcntl.LOCK_EX):
            if monotonic() > end:
                raise PlaceInUseError(f"{out} is in use by {lock.read().strip() or 'another process'}")
            sleep(LOOK_SECONDS / 10)
        lock.truncate()
        lock.write(f"process {os.getpid()} on {socket.gethostname()}")
        lock.flush()
        try:
            yield
        finally:
            lock.seek(0)
            lock.truncate()


def holder(out: Path) -> str | None:
    """Say which process holds a place; None where none does. Writes nothing."""
    try:
        descriptor = os.open(_lock_path(out), os.O_RDONLY | os.O_CLOEXEC)
    except FileNotFoundError:
        return None
    with os.fdopen(descriptor) as lock:
        if _locked(descriptor, fcntl.LOCK_SH):
            return None
        return lock.read().strip() or "another process"


def _locked(descriptor: int, kind: int) -> bool:
    """Take a lock of a kind, if it is to be had now."""
    try:
        fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
