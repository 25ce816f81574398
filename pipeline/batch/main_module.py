"""Worker processes that do not import the script which started the batch."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import spawn
from typing import Any

MAIN = ("init_main_from_name", "init_main_from_path")


@contextmanager
def main_not_imported() -> Iterator[None]:
    """Start processes without their importing the main module.

    `multiprocessing` imports it in every process that it spawns, to find functions that are defined there. A
    script without ``if __name__ == "__main__"`` would start its batch again in each of them. Tasks of a batch
    come from this package alone.
    """
    original = spawn.get_preparation_data

    def without_main(name: str) -> dict[str, Any]:
        prepared = original(name)
        return {key: value for key, value in prepared.items() if key not in MAIN}

    spawn.get_preparation_data = without_main
    try:
        yield
    finally:
        spawn.get_preparation_data = original
