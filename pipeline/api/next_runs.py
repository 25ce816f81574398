"""Runs that are chosen beside a sample, where a named probability is least certain."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pipeline.emulation.chosen import with_chosen
from pipeline.emulation.errors import NotEmulatedError
from pipeline.emulation.next_runs import Target, chosen_runs, known_of, target_of
from pipeline.emulation.sampled import sampled
from pipeline.errors import OptionError
from pipeline.store import zarr_store
from pipeline.store.place import LEVEL, chosen_number, chosen_paths, store_path
from pipeline.store.storage import is_made
from pipeline.store.variables import COMPUTED, Status

if TYPE_CHECKING:
    from pipeline.scenario.scenario import Scenario
    from pipeline.store.storage import Location

MOST = 10_000


@dataclass(frozen=True)
class Choice:
    """A choice of runs that is asked for.

    Parameters
    ----------
    base : Scenario
        Of the sample, on its widest spacing.
    out : Location
        The place.
    target : Target
        What the runs are for.
    count : int
        How many.
    """

    base: Scenario
    out: Location
    target: Target
    count: int

    def going_on(self, chosen: Iterable[Scenario]) -> bool:
        """Whether runs that were chosen for the target are not all done: then no others are chosen."""
        return any(
            each.chosen is not None
            and each.chosen.target == str(self.target)
            and bool((zarr_store.statuses(store_path(self.out, each.name)) == Status.PENDING).any())
            for each in chosen
        )

    def scenario(self, tell: Callable[[str], None]) -> Scenario:
        """Choose the runs, by all that is computed.

        Raises
        ------
        OptionError
            If there are too few runs, or leave-one-out does not support the choice.
        """
        path = store_path(self.out, self.base.name)
        try:
            with sampled(path) as runs:
                found = chosen_runs(runs, self.target, self.count)
        except NotEmulatedError as error:
            raise OptionError("for", f"{self.base.name}: cannot choose runs: {error}") from None
        number = 1 + max(map(chosen_number, chosen_paths(path)), default=0)
        made = with_chosen(self.base, self.out, number, found)
        count = len(next(iter(found.draws.values())))
        tell(f"{made.name}: {count} runs chosen for {found.target}, from {found.origin}")
        return made

    def told(self) -> str:
        """Say what all runs give of the target."""
        with sampled(store_path(self.out, self.base.name)) as runs:
            return f"{self.base.name}: {self.target}: {known_of(runs, self.target)}, from {runs.words}"


def asked(scenarios: Sequence[Scenario], out: Location, count: int | None, text: str | None) -> Choice | None:
    """Check a choice of runs that is asked for; None where none is.

    Raises
    ------
    OptionError
        If it cannot be made, whatever the runs are.
    """
    if count is None and text is None:
        return None
    if text is None:
        raise OptionError("next", "expected with --for, as in --for 'school: depth > 1.2'")
    if count is None:
        raise OptionError("for", "expected with --next, as in --next 16")
    if not 1 <= count <= MOST:
        raise OptionError("next", f"expected 1 to {MOST:,} runs, found {count}")
    bases = [scenario for scenario in scenarios if LEVEL not in scenario.name]
    if len(bases) != 1:
        raise OptionError("next", f"expected one scenario, found {len(bases)}")
    if bases[0].settings.sample is None:
        raise OptionError("next", f"expected a scenario with a sample, found none in {bases[0].name}")
    try:
        target = target_of(text, bases[0].settings)
    except ValueError as error:
        raise OptionError("for", str(error)) from None
    path = store_path(out, bases[0].name)
    if not is_made(path) or not np.isin(zarr_store.statuses(path), COMPUTED).any():
        found = f"expected runs of {bases[0].name} to choose by, found none in {out}"
        raise OptionError("next", f"{found}; do them without --next first")
    return Choice(bases[0], out, target, count)
