"""The lock of a folder: a file that one driver locks, or the parts of one, as long as the process lives."""

from __future__ import annotations

import fcntl
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from time import monotonic, sleep
from typing import IO

LOCK = ".lock"
# A look at the lock holds it for a moment; a driver waits that long before it believes the place in use.
LOOK_SECONDS = 0.5


class TakenError(Exception):
    """Another process holds the place; ``str()`` says which."""


@contextmanager
def held(out: Path) -> Iterator[None]:
    """Hold a folder, made where it is missing.

    The system lets go of the lock when the process ends, however it ends. The file stays, but where nothing
    was written beside it; then it goes, and the folder with it if it was made for the lock.

    Raises
    ------
    TakenError
        If another process holds it.
    OSError
        If the folder cannot be made or written.
    """
    own = not out.exists() or (out / LOCK).exists()
    with _opened(out, LOCK) as lock:
        for _ in _tries():
            if _locked(lock, fcntl.LOCK_EX) and _there(lock, out):
                break
        else:
            raise TakenError(f"{out} is in use by {_holder(lock)}")
        _sign(lock, owner())
        try:
            yield
        finally:
            _sign(lock, "")
            # a user may have moved it away
            if out.is_dir() and [each.name for each in out.iterdir()] == [LOCK]:
                (out / LOCK).unlink()
                if own:
                    # another may have begun to use it
                    with suppress(OSError):
                        out.rmdir()


@contextmanager
def held_in_part(out: Path, index: int, count: int, scenarios: str) -> Iterator[bool]:
    """Hold part ``index`` of ``count``; gives whether nobody else was there.

    Raises
    ------
    TakenError
        If a driver of the whole holds the folder, parts of something else do, or another process this part.
    OSError
        If the folder cannot be made or written.
    """
    role = f"parts of {count}, of scenarios {scenarios[:12]}"
    with _opened(out, LOCK) as lock, _opened(out, f"{LOCK}-part-{index}") as own:
        alone = False
        for _ in _tries():
            if _locked(lock, fcntl.LOCK_EX):
                alone = True
                _sign(lock, role)
            # another may come between the two; what is signed then is theirs
            if _locked(lock, fcntl.LOCK_SH) and _holder(lock) == role and _there(lock, out):
                break
            alone = False
            fcntl.flock(lock, fcntl.LOCK_UN)
        else:
            raise TakenError(f"{out} is in use by {_holder(lock)}")
        if not _locked(own, fcntl.LOCK_EX):
            raise TakenError(f"{out}: part {index}/{count} is in use by {_holder(own)}")
        _sign(own, owner())
        yield alone


def holder(out: Path) -> str | None:
    """Say which process holds a folder; None where none does. Writes nothing."""
    try:
        lock = (out / LOCK).open()
    except FileNotFoundError:
        return None
    with lock:
        return None if _locked(lock, fcntl.LOCK_EX) else _holder(lock)


def owner() -> str:
    """Say which process this is."""
    return f"process {os.getpid()} on {socket.gethostname()}"


@contextmanager
def _opened(out: Path, name: str) -> Iterator[IO[str]]:
    out.mkdir(parents=True, exist_ok=True)
    with os.fdopen(os.open(out / name, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644), "r+") as file:
        yield file


def _there(lock: IO[str], out: Path) -> bool:
    """Whether a file is still that of its name; locks on one that was removed keep nobody off."""
    try:
        return os.path.samestat(os.fstat(lock.fileno()), (out / LOCK).stat())
    except FileNotFoundError:
        return False


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
