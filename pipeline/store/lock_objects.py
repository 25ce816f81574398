"""The lock of a place that is a URL: objects that one process alone can create, renewed while it lives."""

from __future__ import annotations

import _thread
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from threading import Event, Thread
from time import monotonic, sleep
from typing import TYPE_CHECKING

from pipeline.store import objects
from pipeline.store.lock_files import TakenError

if TYPE_CHECKING:
    from pipeline.store.storage import Location

BEAT_SECONDS = 5.0
# An owner that was not heard of for so long is dead, by the clock of who waits.
DEAD_SECONDS = 30.0
WHOLE = "whole"


def locks(folder: Location, role: str) -> dict[str, str]:
    """Give the locks that exclude a role, their contents by name.

    A role is ``whole``, or ``part-<index>-of-<what all parts have in common>``.
    """
    found = {}
    if folder.exists():
        for lock in sorted(folder.iterdir(), key=str):
            if _excludes(lock.name.rpartition(".")[0], role) and (content := _read(lock)):
                found[lock.name] = content
    return found


@contextmanager
def held(folder: Location, role: str, owner: str) -> Iterator[None]:
    """Hold a role.

    Parameters
    ----------
    folder : Location
        Of the locks of a place.
    role : str
        What is to be excluded, see `locks`.
    owner : str
        Who this is, in words.

    Raises
    ------
    TakenError
        If another holds it, or came at the same time.
    OSError
        If the place does not answer.
    """
    with objects.reached():
        dead = _dead(folder, role)
        own = [int(name.rpartition(".")[2]) for name in dead if name.startswith(f"{role}.")]
        lock = folder / f"{role}.{max(own, default=0) + 1}"
        content = _content(owner)
        try:
            objects.create(lock, content.encode())
        except FileExistsError:
            raise _taken(folder, _read(lock)) from None
        others = {n: c for n, c in locks(folder, role).items() if n != lock.name and dead.get(n) != c}
        if others:
            lock.unlink()
            raise _taken(folder, next(iter(others.values())))
        for name in dead:
            (folder / name).unlink(missing_ok=True)
    ended = Event()
    beating = Thread(target=_beat, args=(lock, owner, content, ended), daemon=True)
    beating.start()
    try:
        yield
    finally:
        ended.set()
        beating.join()
        with objects.reached():
            lock.unlink(missing_ok=True)


def _dead(folder: Location, role: str) -> dict[str, str]:
    """Give the locks of owners that are dead; waits until that is sure."""
    first, began = locks(folder, role), monotonic()
    while first and monotonic() - began < DEAD_SECONDS:
        sleep(BEAT_SECONDS / 2)
        now = locks(folder, role)
        if changed := [content for name, content in now.items() if first.get(name) != content]:
            raise _taken(folder, changed[0])
        first = now
    return first


def _beat(lock: Location, owner: str, content: str, ended: Event) -> None:
    """Renew a lock; stop the batch as Ctrl-C does where another has taken the place meanwhile."""
    heard = monotonic()
    while not ended.wait(BEAT_SECONDS):
        try:
            if _read(lock) != content:
                break
            content = _content(owner)
            objects.put(lock, content.encode())
            heard = monotonic()
        except OSError:
            if monotonic() - heard > DEAD_SECONDS:
                break
    else:
        return
    sys.stderr.write(f"{lock.parent}: the lock was taken over or cannot be renewed\n")
    _thread.interrupt_main()


def _excludes(other: str, role: str) -> bool:
    """Whether two roles exclude each other: all do but different parts of one whole."""
    (_, _, whose), (_, _, mine) = other.partition("-of-"), role.partition("-of-")
    return other == role or WHOLE in (other, role) or whose != mine


def _content(owner: str) -> str:
    return f"{owner}, as of {datetime.now(UTC).isoformat()}"


def _taken(folder: Location, content: str) -> TakenError:
    return TakenError(f"{folder.parent} is in use by {_words(content)}")


def _words(content: str) -> str:
    return content.rpartition(".")[0] + " UTC" if content else "another process"


def _read(lock: Location) -> str:
    """Give the content of a lock, empty where it is gone."""
    try:
        with objects.reached():
            return lock.read_bytes().decode()
    except FileNotFoundError:
        return ""


def holder(folder: Location) -> str | None:
    """Say who holds a place in any role, and when they last said so; None where nobody does."""
    found = locks(folder, WHOLE)
    return ", ".join(map(_words, found.values())) or None
