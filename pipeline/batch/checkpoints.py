"""Checkpoints of long runs: files beside the store, from which a run that was cut off goes on."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.store.objects import reached
from pipeline.store.storage import Location, put, storage_of
from solver.checkpoint import Snapshot

EVERY_SECONDS = 60.0


@dataclass(frozen=True)
class Checkpoints:
    """Where the runs of a store keep their checkpoints.

    Parameters
    ----------
    folder : Location
        Hidden, beside the store.
    identity : str
        Of scenario and solver; what has another is ignored.
    every : float
        Elapsed time of a run between two checkpoints, s.
    """

    folder: Location
    identity: str
    every: float = EVERY_SECONDS

    def of(self, run: int) -> Checkpoint:
        """Give the keeper of a run's checkpoint."""
        return Checkpoint(self.folder, run, self.identity, self.every)

    def clear(self) -> None:
        """Remove all checkpoints."""
        storage_of(self.folder).remove()


@dataclass
class Checkpoint:
    """The checkpoint of one run, a `solver.checkpoint.Keeper`.

    The state is one file, replaced as a whole. Frames are written once: a file holds those that came since
    the checkpoint before. ``_marks`` are the output times passed at 0 and at each such file.
    """

    folder: Location
    run: int
    identity: str
    every: float
    _marks: list[int] = field(default_factory=lambda: [0])

    @property
    def _state(self) -> Location:
        return self.folder / f"{self.run}.npz"

    def _part(self, first: int) -> Location:
        return self.folder / f"{self.run}-frames-{first}.npz"

    def load(self) -> Snapshot | None:
        """Give the last snapshot; None where there is none of this run that can be read."""
        if not self._state.exists():
            return None
        try:
            held = _read(self._state)
            if str(held.pop("identity")) != self.identity:
                return None
            marks, (wall, cpu) = held.pop("marks").tolist(), held.pop("used").tolist()
            parts = [list(_read(self._part(first)).values()) for first in marks[:-1]]
            frames = tuple(np.concatenate(pieces) for pieces in zip(*parts, strict=True))
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return None
        self._marks = marks
        return Snapshot(held, marks[-1], frames, wall, cpu)

    def save(self, snapshot: Snapshot) -> None:
        """Keep a snapshot in place of the last; without room for it the run goes on without."""
        first, marks = self._marks[-1], self._marks
        with suppress(OSError):
            self.folder.mkdir(exist_ok=True)
            if snapshot.passed > first:
                self._write(self._part(first), {str(k): a[first:] for k, a in enumerate(snapshot.frames)})
                marks = [*marks, snapshot.passed]
            more = {"identity": self.identity, "marks": marks, "used": [snapshot.wall, snapshot.cpu]}
            self._write(self._state, {**snapshot.carried, **more})
            self._marks = marks

    def remove(self) -> None:
        """Remove the checkpoint of a run that has ended."""
        if not self.folder.exists():
            return
        for file in (self._state, *self.folder.glob(f"{self.run}-frames-*.npz")):
            file.unlink(missing_ok=True)
        storage_of(self.folder).remove_if_empty()

    def _write(self, path: Location, arrays: Mapping[str, Any]) -> None:
        """Write a file that appears whole or not at all."""
        held = BytesIO()
        np.savez(held, **arrays)
        put(path, held.getvalue())


def _read(path: Location) -> dict[str, NDArray[Any]]:
    with reached(), np.load(BytesIO(path.read_bytes())) as file:
        return {name: file[name] for name in file.files}
