"""The table of what the loops of a stage cost, for `pipeline bench`."""

from __future__ import annotations

from collections.abc import Iterator

from solver.kernel_profile import kernel_costs

TITLE = "Kernels"
COLUMNS = (
    "kernel",
    "passes a stage",
    "ns a cell and pass",
    "vector instructions",
    "of them divisions",
    "roots",
    "ns a cell-stage",
    "of it divisions and roots alone",
)


def rows() -> Iterator[list[str]]:
    """Time the loops of a stage on a lattice, and give the cells of a line for each and one for all."""
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
