"""What a place holds: how far each scenario is, what made it, and who is at it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from pipeline.store import provenance, zarr_store
from pipeline.store.place import holder, store_name, store_paths, with_levels
from pipeline.store.provenance import short
from pipeline.store.storage import Location
from pipeline.store.variables import CHOSEN_FOR, Status


@dataclass(frozen=True)
class Survey:
    """One store: how many runs are in which state, and its attributes."""

    name: str
    statuses: Counter[Status]
    attributes: dict[str, Any]

    @property
    def finished(self) -> bool:
        """Whether no run is pending."""
        return not self.statuses[Status.PENDING]

    def __str__(self) -> str:
        """Two lines: the counts, and what made the store."""
        total = sum(self.statuses.values())
        shown = [s for s in Status if self.statuses[s] or not s.is_cut_off]
        counts = ", ".join(f"{self.statuses[s]} {s.plain_words}" for s in shown)
        held = self.attributes
        summaries = [short(each) for each in str(held.get("summary_hash", "unknown")).split()]
        made = (
            f"made by lmls {held.get('lmls_version', 'unknown')}, solver {short(held.get('solver_hash'))}, "
            f"summaries {' and '.join(summaries)}"
        )
        changed = provenance.differences(held)
        note = f"; another one here: {', '.join(changed)}" if changed else ""
        if (here := short(provenance.made_by()["summary_hash"])) not in summaries:
            note += f"; summaries here: {here}"
        scenario = short(held.get("scenario_hash"))
        chosen = f"\n  chosen for {held[CHOSEN_FOR]}; no part of the sample" if CHOSEN_FOR in held else ""
        head = f"{self.name}: {total} run{'s' * (total != 1)}: {counts}{chosen}"
        return f"{head}\n  scenario {scenario}, {made}{note}"


def survey(out: Location) -> Iterator[Survey]:
    """Survey the stores of a place, one by one; what is no store of scenarios is passed over.

    Raises
    ------
    FileNotFoundError
        If there is none.
    """
    for path in with_levels(store_paths(out)):
        if "scenario_hash" not in zarr_store.attributes(path):
            continue
        yield Survey(
            store_name(path), Counter(map(Status, zarr_store.statuses(path))), zarr_store.attributes(path)
        )


def use(out: Location) -> str:
    """Say who is at a place."""
    found = holder(out)
    return f"in use by {found}" if found else "no process uses it"
