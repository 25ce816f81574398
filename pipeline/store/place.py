"""The place results go to: what lies where in it, and its lock, held by one driver or by the parts of one."""

from __future__ import annotations

import fcntl
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep
from typing import IO

from pipeline.errors import PlaceInUseError as PlaceInUseError
from pipeline.store import lock_objects, storage

# A look at the lock holds it for a moment; a driver waits that long before it believes the place in use.
LOOK_SECONDS = 0.5


LOCK = ".lock"


@dataclass(frozen=True)
class Part:
    """One of ``count`` parts of the runs; ``index`` counts from 1."""

    index: int
    count: int

    def __str__(self) -> str:
        """``1/4``, as it is given."""
        return f"{self.index}/{self.count}"

    def has(self, group: int) -> bool:
        """Whether a group of runs belongs to it."""
        return group % self.count == self.index - 1


WHOLE = Part(1, 1)


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
    found = (path for path in out.glob("*.zarr") if not path.name.startswith("."))
    paths = sorted(filter(storage.is_made, found), key=str)
    if not paths:
        raise FileNotFoundError(f"no results in {out}")
    return paths


def checkpoint_path(out: Path, name: str) -> Path:
    """Folder of the checkpoints of a scenario's runs."""
    return out / f".{name}.checkpoints"


def log_path(out: Path) -> Path:
    """Log of a place: a line for every run that ended."""
    return out / "runs.log"


def indices_path(out: Path) -> Path:
    """Table of the indices of sensitivity over all scenarios of the place."""
    return out / "sensitivity.csv"


def summary_path(out: Path) -> Path:
    """Table over all scenarios of the place."""
    return out / "summary.csv"


@contextmanager
def held(out: Path) -> Iterator[None]:
    """Hold a place, made where it is missing, as its only driver.

    In a folder the system lets go of the lock when the process ends, however it ends. The file stays:
    removing it would let two processes hold locks on two files of one name. At a URL the lock is an object
    that is renewed.

    Raises
    ------
    PlaceInUseError
        If another process holds it.
    OSError
        If the place cannot be made or written.
    """
    if storage.is_url(out):
        with _objects(out, lock_objects.WHOLE):
            yield
        return
    with _opened(out, LOCK) as lock:
        for _ in _tries():
            if _locked(lock, fcntl.LOCK_EX):
                break
        else:
            raise PlaceInUseError(f"{out} is in use by {_holder(lock)}")
        _sign(lock, _me())
        try:
            yield
        finally:
            _sign(lock, "")


@contextmanager
def held_in_part(out: Path, part: Part, scenarios: str) -> Iterator[bool]:
    """Hold a part of a place, beside other parts of the same whole and nobody else.

    Parameters
    ----------
    out : Path
        The place, made where it is missing.
    part : Part
        Which one; nobody else may hold it.
    scenarios : str
        Hash of what is done; all parts have the same.

    Yields
    ------
    bool
        Whether nobody else was there; at a URL not looked at.

    Raises
    ------
    PlaceInUseError
        If a driver of the whole holds the place, parts of something else do, or another process this part.
    OSError
        If the place cannot be made or written.
    """
    role = f"parts of {part.count}, of scenarios {scenarios[:12]}"
    if storage.is_url(out):
        with _objects(out, f"part-{part.index}-of-{part.count}-{scenarios[:12]}"):
            yield False
        return
    with _opened(out, LOCK) as lock, _opened(out, f"{LOCK}-part-{part.index}") as own:
        alone = False
        for _ in _tries():
            if _locked(lock, fcntl.LOCK_EX):
                alone = True
                _sign(lock, role)
            # another may come between the two; what is signed then is theirs
            if _locked(lock, fcntl.LOCK_SH) and _holder(lock) == role:
                break
            alone = False
            fcntl.flock(lock, fcntl.LOCK_UN)
        else:
            raise PlaceInUseError(f"{out} is in use by {_holder(lock)}")
        if not _locked(own, fcntl.LOCK_EX):
            raise PlaceInUseError(f"{out}: part {part} is in use by {_holder(own)}")
        _sign(own, _me())
        yield alone


def holder(out: Path) -> str | None:
    """Say which process holds a place; None where none does. Writes nothing.

    At a URL it is the process that said so last; one that was killed is named until another comes.
    """
    if storage.is_url(out):
        return lock_objects.holder(out / LOCK)
    try:
        lock = (out / LOCK).open()
    except FileNotFoundError:
        return None
    with lock:
        return None if _locked(lock, fcntl.LOCK_EX) else _holder(lock)


@contextmanager
def _objects(out: Path, role: str) -> Iterator[None]:
    try:
        with lock_objects.held(out / LOCK, role, _me()):
            yield
    except lock_objects.TakenError as error:
        raise PlaceInUseError(f"{out} is in use by {error}") from None


def _me() -> str:
    return f"process {os.getpid()} on {socket.gethostname()}"


@contextmanager
def _opened(out: Path, name: str) -> Iterator[IO[str]]:
    out.mkdir(parents=True, exist_ok=True)
    with os.fdopen(os.open(out / name, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644), "r+") as file:
        yield file


def _tries() -> Iterator[None]:
    end = monotonic() + LOOK_SECONDS
    while monotonic() < end:
        yield
        sleep(LOOK_SECONDS / 10)


def _holder(lock: IO[str]) -> str:
    lock.seek(0)
    return lock.read().strip() or "another process"


def _sign(lock: IO[str], text: str) -> None:
    lock.seek(0)
    lock.truncate()
    lock.write(text)
    lock.flush()


def _locked(file: IO[str], kind: int) -> bool:
    """Take a lock of a kind, if it is to be had now."""
    try:
        fcntl.flock(file, kind | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
