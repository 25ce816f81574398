"""Emulators of what is mapped: one for each threshold over the lattice, and one for each receptor."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.assess.frames import speed_of
from pipeline.assess.tables import behind
from pipeline.emulation.sampled import Sampled
from pipeline.hazard.quantities import QUANTITIES, Quantity
from pipeline.settings.hazard import Hazard
from pipeline.store.variables import RETURN_PERIOD
from solver.emulator import support
from solver.emulator.exceedance import REST, Exceedance, exceedances
from solver.emulator.extrapolation import at_place, on_lattice
from solver.emulator.fields import Chosen, FieldLevel, choose
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
    unsettled : array or float
        Share of the runs that were overrun or cut off, and might have exceeded it, among those that did not:
        at the receptor, or at each point of the lattice.
    found : Exceedance, optional
        Its probabilities, where the runs support them.
    """

    quantity: Quantity
    threshold: float
    receptor: str
    chosen: Chosen | None
    verdict: Verdict
    unsettled: Array | float = 0.0
    found: Exceedance | None = None

    @property
    def words(self) -> str:
        """``depth above 0.5 m``, with the receptor where it is of one."""
        told = f"{self.quantity.name.replace('_', ' ')} above {self.threshold:g} {self.quantity.units}"
        return f"{told}, {self.receptor or 'map'}"

    def row(self, runs: Sampled) -> dict[str, object]:
        """Row of the table of leave-one-out."""
        score = None if self.chosen is None else self.chosen.score
        single = None if self.chosen is None else self.chosen.of_values
        return {
            **behind(runs.stores[0]),
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
        {**behind(store), "what": what, "verdict": PLAIN, **empty, "reason": reason}
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


def with_probabilities(
    runs: Sampled, thresholds: Sequence[Threshold], few: Draws, many: Draws
) -> list[Threshold]:
    """Give thresholds with their probabilities, over few draws on maps, over many at receptors.

    Where runs that were overrun or cut off may raise a probability by more than its error, it is doubtful.
    """
    found: dict[int, Threshold] = {}
    for mapped, draws in ((True, few), (False, many)):
        some = [
            (each, each.chosen)
            for each in thresholds
            if each.chosen is not None and not each.verdict.refused and mapped is (not each.receptor)
        ]
        together = exceedances_of(runs, [chosen for _, chosen in some], draws, mapped=mapped)
        for (each, _), one in zip(some, together, strict=True):
            verdict = _bounded_below(each.verdict, one, each.unsettled, runs.told_of_unsettled)
            found[id(each)] = replace(each, found=one, verdict=verdict)
    return [found.get(id(each), each) for each in thresholds]


def _bounded_below(verdict: Verdict, found: Exceedance, unsettled: Array | float, told: str) -> Verdict:
    """Add to a verdict what runs that were overrun or cut off leave open."""
    open_ended = (1 - found.probability) * unsettled
    if not open_ended.any():
        return verdict
    worst = int(np.argmax(open_ended - _error(found)))
    error = float(_error(found)[worst])
    words = f"a lower bound: {told}, which may add up to {open_ended[worst]:.2g}"
    if open_ended[worst] > error:
        return replace(verdict, warned=(*verdict.warned, f"{words}, more than the error of {error:.2g}"))
    return replace(verdict, noted="; ".join(filter(None, [verdict.noted, words])))


def _error(found: Exceedance, typical: float | None = None) -> Array:
    """Half width of the error of runs that are known in full; of one level it is that of sampling."""
    return found.total(typical) if found.levels > 1 else found.sampling + REST


def with_errors(
    found: Exceedance, typical: float | None = None, unsettled: Array | float = 0.0
) -> Mapping[str, Array]:
    """Give probabilities, their upper bounds and their errors by the endings of their names.

    Runs that were overrun or cut off count as they were computed, in the upper bound as exceeding. What they
    may add is part of the total error.
    """
    open_ended = (1 - found.probability) * unsettled
    return {
        "": found.probability,
        "_upper": found.probability + open_ended,
        "_sampling": found.sampling,
        "_discretisation": found.discretisation(typical),
        "_error": _error(found, typical) + open_ended,
    }


def unsettled_share(
    runs: Sampled, fields: Sequence[FieldLevel], limit: float, receptor: str = ""
) -> Array | float:
    """Give the share of the runs that were overrun or cut off among those whose field stays below a limit.

    At a receptor it is one number, else of each point of the finest lattice, in their order. Of several
    levels it is the largest.
    """
    found: Array | float = 0.0
    last = fields[-1]
    for level, (each, states) in enumerate(zip(fields, runs.unsettled, strict=True)):
        if not states.any():
            continue
        below = (each.values <= limit).reshape(len(each.values), -1)
        if receptor:
            below = np.asarray(below[:, each.places[receptor]].all(axis=1, keepdims=True))
        weight = runs.level_weight(level)
        of_all, some = weight @ below, (weight * states) @ below
        share = np.divide(some, of_all, out=np.zeros_like(some), where=of_all > 0)
        if not receptor:
            y, x = (
                np.abs(points[:, None] - there).argmin(axis=0)
                for points, there in ((each.y, last.y), (each.x, last.x))
            )
            share = share.reshape(len(each.y), len(each.x))[np.ix_(y, x)].ravel()
        found = np.maximum(found, share)
    return found


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
            verdict, share = _verdict(found, threshold, runs.doubts), unsettled_share(runs, fields, limit)
            yield Threshold(quantity, threshold, "", found, verdict, share)
        for receptor in fields[0].places:
            chosen = places.get((receptor, limit))
            verdict = _verdict(chosen, threshold, runs.doubts)
            share = unsettled_share(runs, fields, limit, receptor)
            yield Threshold(quantity, threshold, receptor, chosen, verdict, share)


def _verdict(chosen: Chosen | None, threshold: float, doubts: Sequence[str]) -> Verdict:
    if chosen is None:
        return Verdict(f"a threshold of {threshold:g} is too low to be told from dry")
    found = support.of_exceedance(chosen.score)
    if found.refused:
        return found
    jumps = () if chosen.of_values is None else support.jumps(chosen.of_values)
    return Verdict(warned=(*found.warned, *jumps, *doubts))
