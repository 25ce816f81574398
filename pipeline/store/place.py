"""The place results go to: what lies where in it, and its lock, held by one driver or by the parts of one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from pipeline.errors import PlaceInUseError as PlaceInUseError
from pipeline.store.lock_files import TakenError
from pipeline.store.storage import Location, is_made, storage_of


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
# file of a store that makes it one
ROOT = "zarr.json"
MOST_NAMED = 5
# between the name of a scenario and that of one of its finer levels, which no name of a scenario has
LEVEL = "/"
# begins the name of runs that were chosen beside a sample, ``valley/chosen-1``
CHOSEN = "chosen-"


def store_path(out: Location, name: str) -> Location:
    """Store of a scenario; that of a finer level, ``valley/4m``, is a group within it."""
    whole, _, level = name.partition(LEVEL)
    path = out / f"{whole}.zarr"
    return path / f"{level}.zarr" if level else path


def store_name(path: Location) -> str:
    """Name of the scenario, or of the level, that a store is of."""
    return f"{path.parent.stem}{LEVEL}{path.stem}" if path.parent.suffix == ".zarr" else path.stem


def hidden(name: str) -> str:
    """Write the name of a scenario or level as the part of a name of a file."""
    return name.replace(LEVEL, "@")


def with_levels(paths: Sequence[Location]) -> list[Location]:
    """List stores, each followed by those of its finer levels and of its chosen runs."""
    return [
        each
        for path in paths
        for each in (path, *sorted(filter(is_made, path.glob("*m.zarr")), key=str), *chosen_paths(path))
    ]


def chosen_paths(path: Location) -> list[Location]:
    """List the stores of the runs that were chosen beside those of a store, the first ones first."""
    return sorted(filter(is_made, path.glob(f"{CHOSEN}*.zarr")), key=chosen_number)


def chosen_number(path: Location) -> int:
    """Give the number of a store of chosen runs, from 1."""
    return int(path.stem.removeprefix(CHOSEN))


def store_paths(out: Location) -> list[Location]:
    """List the stores of a place.

    Raises
    ------
    FileNotFoundError
        If there is none.
    """
    found = (path for path in out.glob("*.zarr") if not path.name.startswith("."))
    paths = sorted(filter(is_made, found), key=str)
    if not paths:
        if (out / ROOT).exists():
            raise FileNotFoundError(not_a_place(out))
        raise FileNotFoundError(f"no results in {out}")
    return paths


def not_a_place(store: Location) -> str:
    """Say that a store was given where a place was expected."""
    return f"{store}: expected the place that stores lie in, {store.parent}, found the store of one scenario"


def not_a_store(path: Location) -> str:
    """Say that there is no store, and which ones there are where a place was given."""
    stores = [str(each) for each in sorted(path.glob("*.zarr"), key=str) if (each / ROOT).exists()]
    if not stores:
        return f"{path}: expected the store of a scenario, as <out>/<name>.zarr, found none"
    named = ", ".join(stores[:MOST_NAMED]) + (", ..." if len(stores) > MOST_NAMED else "")
    return f"{path}: expected a store, found a place; its stores are {named}"


def checkpoint_path(out: Location, name: str) -> Location:
    """Folder of the checkpoints of a scenario's runs."""
    return out / f".{hidden(name)}.checkpoints"


def indices_path(out: Location) -> Location:
    """Table of the indices of sensitivity over all scenarios of the place."""
    return out / "sensitivity.csv"


def summary_path(out: Location) -> Location:
    """Table over all scenarios of the place."""
    return out / "summary.csv"


@contextmanager
def held(out: Location) -> Iterator[None]:
    """Hold a place, made where it is missing, as its only driver.

    Raises
    ------
    PlaceInUseError
        If another process holds it.
    OSError
        If the place cannot be made or written.
    """
    with _in_use(), storage_of(out).held():
        yield


@contextmanager
def held_in_part(out: Location, part: Part, scenarios: str) -> Iterator[bool]:
    """Hold a part of a place, beside other parts of the same whole and nobody else.

    Parameters
    ----------
    out : Location
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
    with _in_use(), storage_of(out).held_in_part(part.index, part.count, scenarios) as alone:
        yield alone


def holder(out: Location) -> str | None:
    """Say which process holds a place; None where none does. Writes nothing."""
    return storage_of(out).holder()


@contextmanager
def _in_use() -> Iterator[None]:
    try:
        yield
    except TakenError as error:
        raise PlaceInUseError(str(error)) from None
