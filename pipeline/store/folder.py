"""A folder of this machine as storage."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from pipeline.store import lock_files

LOG = "runs.log"


@dataclass(frozen=True)
class Folder:
    """A path of this machine, a `pipeline.store.storage.Storage`."""

    path: Path

    def absolute(self) -> Path:
        """Give the path from the root."""
        return self.path.absolute()

    def at_hand(self) -> Path:
        """Give the path itself."""
        return self.path

    def log(self) -> Path:
        """Give the log of a place."""
        return self.path / LOG

    def to_zarr(self) -> Path:
        """Give what zarr opens."""
        return self.path

    def is_made(self) -> bool:
        """Whether there is a store."""
        return self.path.exists()

    def put(self, data: bytes) -> None:
        """Write a file, which replaces what was there once it is whole."""
        if not self.path.parent.is_dir():
            raise FileNotFoundError(f"{self.path}: expected a file in a folder that is there")
        try:
            with whole(self.path) as aside:
                aside.write_bytes(data)
        except OSError as error:
            # of the file that is asked for, not of the one beside it
            raise OSError(error.errno, error.strerror, str(self.path)) from error

    def aside(self) -> Path:
        """Make a folder beside the path, from which a store can be renamed to it."""
        made = tempfile.mkdtemp(prefix=f".{self.path.name}.", suffix=".partial", dir=self.path.parent)
        aside = Path(made)
        aside.chmod(0o755)
        return aside

    def publish(self, aside: Path, *, replace: bool) -> None:
        """Rename a store to its path."""
        if not replace:
            try:
                # a folder takes no other's place that has something in it
                aside.rename(self.path)
            except OSError as error:
                shutil.rmtree(aside)
                if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                    raise
        elif self.path.exists():
            old = aside.with_name(f"{aside.name}.old.partial")
            self.path.rename(old)
            aside.rename(self.path)
            shutil.rmtree(old)
        else:
            aside.rename(self.path)

    def remove(self) -> None:
        """Remove the folder with all that is in it."""
        shutil.rmtree(self.path, ignore_errors=True)

    def remove_if_empty(self) -> None:
        """Remove the folder if there is nothing in it."""
        with suppress(OSError):
            self.path.rmdir()

    def sweep(self) -> int:
        """Remove all files and folders that are named as partial."""
        found = 0
        for folder, folders, files in os.walk(self.path):
            for name in [f for f in folders if f.endswith(".partial")]:
                shutil.rmtree(Path(folder, name))
                folders.remove(name)
                found += 1
            for name in files:
                if name.endswith(".partial"):
                    Path(folder, name).unlink()
                    found += 1
        return found

    def held(self) -> AbstractContextManager[None]:
        """Hold the place by a lock that the system lets go of when the process ends, however it ends."""
        return lock_files.held(self.path)

    def held_in_part(self, index: int, count: int, scenarios: str) -> AbstractContextManager[bool]:
        """Hold a part of the place, beside other parts of the same whole and nobody else."""
        return lock_files.held_in_part(self.path, index, count, scenarios)

    def holder(self) -> str | None:
        """Say which process holds the place."""
        return lock_files.holder(self.path)


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
