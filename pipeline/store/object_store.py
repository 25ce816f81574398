"""The objects of a URL as storage."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.store import lock_objects, objects
from pipeline.store.lock_files import LOCK, owner

if TYPE_CHECKING:
    from zarr.storage import FsspecStore

    from pipeline.store.storage import Location


@dataclass(frozen=True)
class ObjectStore:
    """A URL, a `pipeline.store.storage.Storage`.

    An object appears whole or not at all. A store is one once its root is there, which is written last.
    """

    path: Location

    def absolute(self) -> Location:
        """Give the URL itself."""
        return self.path

    def at_hand(self) -> Path:
        """Give its last part in the folder one is in."""
        return Path(self.path.name)

    def log(self) -> None:
        """Give no log: nothing is appended to objects."""
        return

    def to_zarr(self) -> FsspecStore:
        """Give what zarr opens."""
        from zarr.storage import FsspecStore

        return FsspecStore.from_url(str(self.path), storage_options=objects.OPTIONS)

    def is_made(self) -> bool:
        """Whether there is the root of a store."""
        return (self.path / "zarr.json").exists()

    def put(self, data: bytes) -> None:
        """Write an object."""
        objects.put(self.path, data)

    def aside(self) -> Path:
        """Make a folder among the temporary ones of this machine."""
        return Path(tempfile.mkdtemp(prefix=f".{self.path.name}.", suffix=".partial"))

    def publish(self, aside: Path, *, replace: bool) -> None:
        """Upload a store, its root last; parts that come at once upload the same."""
        if replace:
            self.remove()
        elif self.is_made():
            shutil.rmtree(aside)
            return
        with suppress(FileExistsError):
            objects.upload(aside, self.path)

    def remove(self) -> None:
        """Remove all objects below, the root of a store first."""
        objects.remove(self.path)

    def remove_if_empty(self) -> None:
        """Do nothing: without objects there is no folder."""

    def sweep(self) -> int:
        """Remove the points of a killed driver: all else is there whole or not at all."""
        found = list(self.path.glob("*.partial"))
        for left in found:
            left.unlink()
        return len(found)

    def held(self) -> AbstractContextManager[None]:
        """Hold the place by an object that is renewed."""
        return lock_objects.held(self.path / LOCK, lock_objects.WHOLE, owner())

    @contextmanager
    def held_in_part(self, index: int, count: int, scenarios: str) -> Iterator[bool]:
        """Hold a part of the place; whether others are there is not looked at."""
        with lock_objects.held(self.path / LOCK, f"part-{index}-of-{count}-{scenarios[:12]}", owner()):
            yield False

    def holder(self) -> str | None:
        """Say who said last that they hold the place; one that was killed is named until another comes."""
        return lock_objects.holder(self.path / LOCK)
