"""Emulators of what is mapped: one for each threshold over the lattice, and one for each receptor."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.assess.frames import speed_of
from pipeline.emulation.sampled import Sampled
from pipeline.hazard.quantities import QUANTITIES, Quantity
from pipeline.settings.hazard import Hazard
from pipeline.store.variables import RETURN_PERIOD
from solver.emulator import support
from solver.emulator.exceedance import Exceedance, exceedances
from solver.emulator.extrapolation import at_place, on_lattice
from solver.emulator.fields import Chosen, choose
from solver.emulator.levels import Draws
from solver.emulator.support import Verdict

Array = NDArray[np.float64]
# verdict of what the emulator has no method for
PLAIN = "not emulated"
# what values of a field are relative to, in its units: some hundredths of it are the least that is told
SIZES = {"max_depth": 1.0, "max_speed": 5.0, "max_momentum_flux": 10.0}


@dataclass(frozen=True)
class Threshold:
    """A threshold of a quantity over the lattice, or at a receptor, and what emulates it.

    Parameters
    ----------
    chosen : Chosen, optional
        None where the threshold is too low.
    """

    quantity: Quantity
    threshold: float
    receptor: str
    chosen: Chosen | None
    verdict: Verdict

    @property
    def words(self) -> str:
        """``depth above 0.5 m``, with the receptor where it is of one."""
        told = f"{self.quantity.name.replace('_', ' ')} above {self.threshold:g} {self.quantity.units}"
        return f"{told}, {self.receptor or 'map'}"

    def row(self, scenario: str) -> dict[str, object]:
        """Row of the table of leave-one-out."""
        score = None if self.chosen is None else self.chosen.score
        single = None if self.chosen is None else self.chosen.of_values
        return {
            "scenario": scenario,
            "what": self.words,
            "verdict": self.verdict.word,
            "brier_ratio": np.nan if score is None else score.ratio,
            "calibration": np.nan if score is None else score.calibration,
            "q2": np.nan if single is None else single.q2,
            "coverage": np.nan if single is None else single.coverage,
            "worst": np.nan if single is None else single.worst,
            "reason": self.verdict.reason,
        }


def left_plain(runs: Sampled) -> list[dict[str, object]]:
    """Rows of the table of leave-one-out of what is not emulated, whatever the runs are, and why."""
    store = runs.stores[0]
    reasons = {
        "arrival times": (
            "arrival_time" in store,
            "a run has none where nothing arrives, and no value continues it there; the runs give them",
        ),
        "classes of intensity": (
            {"max_depth", "max_speed"} <= {*store},
            "a class joins thresholds of depth and of speed, whose errors go together; the runs give them",
        ),
        "depth of erosion": (
            "erosion_depth" in store,
            "no figure was measured of it against thousands of runs; the runs give it",
        ),
        "peaks, volumes and arrival at sections": (
            "section_peak_discharge" in store,
            "no figure was measured of them against thousands of runs; the runs give them",
        ),
        "events of each return period, levels of hazard": (
            RETURN_PERIOD.name in store.variables,
            "probabilities here are over all events; each period has few runs, which give them",
        ),
    }
    empty = dict.fromkeys(("brier_ratio", "calibration", "q2", "coverage", "worst"), np.nan)
    return [
        {"scenario": runs.name, "what": what, "verdict": PLAIN, **empty, "reason": reason}
        for what, (there, reason) in reasons.items()
        if there
    ]


def limit_of(quantity: Quantity, threshold: float, density: float) -> float:
    """Give the value of its field at which a quantity reaches a threshold: of a pressure the speed."""
    return speed_of(threshold, density) if quantity.name == "pressure" else threshold


def fitted(runs: Sampled, asked: Hazard) -> list[Threshold]:
    """Fit what is asked for on maps, and at receptors, where depth counts from what reaches them on."""
    pressures = [each for each in QUANTITIES if each.name == "pressure" and runs.densities_differ]
    others = [each for each in QUANTITIES if each not in pressures]
    return [
        each
        for name in SIZES
        for together in (others, pressures)
        for each in _of_field(runs, asked, name, together)
    ]


def exceedance_of(runs: Sampled, chosen: Chosen, draws: Draws, *, mapped: bool = False) -> Exceedance:
    """Give the probabilities of one threshold over draws, see `exceedances_of`."""
    return exceedances_of(runs, [chosen], draws, mapped=mapped)[0]


def exceedances_of(
    runs: Sampled, chosen: Sequence[Chosen], draws: Draws, *, mapped: bool = False
) -> list[Exceedance]:
    """Give the probabilities of thresholds over draws, with what runs that are missing leave open.

    Those of one emulator are taken together, which is several times quicker than one by one.

    mapped : whether the emulators are over the lattice.
    """
    found: dict[int, Exceedance] = {}
    weight, past = runs.weight(runs.usable[0]), runs.beyond(draws)
    for emulator in {id(each.levels): each.levels for each in chosen}.values():
        of_it = [each for each in chosen if each.levels is emulator]
        together = exceedances(emulator, [each.level for each in of_it], draws, weight)
        for each, one in zip(of_it, together, strict=True):
            half: Array | float = 0.0
            if past is not None and mapped:
                grid = runs.ensembles[-1]
                spacing = float(np.diff(grid["y"]).mean()), float(np.diff(grid["x"]).mean())
                half = on_lattice(emulator, each.level, past, (grid.sizes["y"], grid.sizes["x"]), spacing)
            elif past is not None:
                half = at_place(emulator, each.level, past)
            found[id(each)] = replace(one, past=half)
    return [found[id(each)] for each in chosen]


def _of_field(runs: Sampled, asked: Hazard, name: str, together: Sequence[Quantity]) -> Iterator[Threshold]:
    """Fit the thresholds of those quantities that come from one field."""
    if name not in runs.stores[0]:
        return
    wanted: dict[tuple[Quantity, float], float] = {}
    for quantity in together:
        thresholds = set(getattr(asked, quantity.name)) if quantity.field == name else set()
        if thresholds and quantity.name == "depth" and runs.threshold is not None:
            thresholds.add(runs.threshold)
        for threshold in sorted(thresholds):
            wanted[quantity, threshold] = limit_of(quantity, threshold, runs.density)
    if not wanted:
        return
    fields = runs.fields(name, of_pressure=all(each.name == "pressure" for each in together))
    limits = list(dict.fromkeys(wanted.values()))
    maps, places = choose(fields, limits, runs.judged(runs.usable[0]), SIZES[name])
    for (quantity, threshold), limit in wanted.items():
        if threshold in getattr(asked, quantity.name):
            found = maps.get(limit)
            yield Threshold(quantity, threshold, "", found, _verdict(found, threshold, runs.doubts))
        for receptor in fields[0].places:
            chosen = places.get((receptor, limit))
            verdict = _verdict(chosen, threshold, runs.doubts)
            yield Threshold(quantity, threshold, receptor, chosen, verdict)


def _verdict(chosen: Chosen | None, threshold: float, doubts: Sequence[str]) -> Verdict:
    if chosen is None:
        return Verdict(f"a threshold of {threshold:g} is too low to be told from dry")
    found = support.of_exceedance(chosen.score)
    if found.refused:
        return found
    jumps = () if chosen.of_values is None else support.jumps(chosen.of_values)
    return Verdict(warned=(*found.warned, *jumps, *doubts))
