"""The tables of what the loops of a stage cost, for `pipeline bench`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from pipeline.studies.kernels.cloud import cloud_costs
from pipeline.studies.kernels.lattice import kernel_costs
from pipeline.studies.kernels.laws import COLUMNS, by_law
from pipeline.studies.kernels.surface import surface_costs


class Table(NamedTuple):
    """A table: title, columns, and what makes its rows, the cells of a line each."""

    title: str
    columns: tuple[str, ...]
    rows: Callable[[], Iterator[list[str]]]


def on_lattices() -> Iterator[list[str]]:
    """Time the loops of a stage on a lattice; a line for each and one for all, as cells."""
    costs, division, root = kernel_costs()
    whole = alone = instructions = 0.0
    for cost in costs:
        taken, least = (cost.passes * q for q in (cost.time, cost.divisions * division + cost.roots * root))
        whole, alone = whole + taken, alone + least
        instructions += cost.passes * cost.instructions
        counts = (str(n) for n in (cost.instructions, cost.divisions, cost.roots))
        yield [cost.name, f"{cost.passes:.2g}", f"{cost.time:.2f}", *counts, f"{taken:.2f}", f"{least:.2f}"]
    rate, all_ = f"all: {1e3 / whole:.0f} million a s", f"{instructions:.0f}"
    yield [rate, "", "", all_, "", "", f"{whole:.2f}", f"{alone:.2f}"]


def on_clouds() -> Iterator[list[str]]:
    """Time the loops of a stage on a cloud; a line for each, one for all, and one for the stage itself."""
    costs, looking_up, moving = cloud_costs()
    *loops, stage = costs
    whole = [0.0] * 5
    for cost in loops:
        least = cost.moved * moving, cost.looked_up * looking_up
        values = [cost.time, cost.moved, cost.looked_up, *least]
        whole = [a + b for a, b in zip(whole, values, strict=True)]
        yield [cost.name, *_numbers(values)]
    yield [f"all: {1e3 / whole[0]:.1f} million a s", *_numbers(whole)]
    yield [f"{stage.name}: {1e3 / stage.time:.1f} million a s", f"{stage.time:.1f}", "", "", "", ""]


def on_surfaces() -> Iterator[list[str]]:
    """Time whole steps on a profile and on elevation models; a line for each."""
    for cost in surface_costs():
        yield [cost.bed, str(cost.cells), f"{cost.time:.1f}", f"{1e3 / cost.time:.1f}", f"{cost.share:.2f}"]


def _numbers(values: list[float]) -> list[str]:
    time, moved, looked_up, *least = values
    return [f"{time:.1f}", f"{moved:.0f}", f"{looked_up:.0f}", *(f"{q:.1f}" for q in least)]


TABLES = (
    Table(
        "Kernels",
        (
            "kernel",
            "passes a stage",
            "ns a cell and pass",
            "vector instructions",
            "of them divisions",
            "roots",
            "ns a cell-stage",
            "of it divisions and roots alone",
        ),
        on_lattices,
    ),
    Table(
        "Kernels on a cloud",
        (
            "kernel",
            "ns a cell-stage",
            "bytes moved in order",
            "values looked up",
            "ns for moving alone",
            "ns for looking up alone",
        ),
        on_clouds,
    ),
    Table(
        "Elevation models",
        ("bed", "wet cells", "ns a cell-stage", "million a s", "of that on the profile"),
        on_surfaces,
    ),
)
# takes the kernels of every law, and a minute
LAWS = Table("Laws of friction", COLUMNS, by_law)


def lines_of(table: Table) -> Iterator[str]:
    """Give a table with its heading as lines of Markdown."""
    yield from (f"## {table.title}", "")
    for cells in (table.columns, ["---"] * len(table.columns), *table.rows()):
        yield f"| {' | '.join(cells)} |"
