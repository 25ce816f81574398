"""The next runs of a scenario: where the probability of a threshold at a receptor is least certain."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.emulation.errors import NotEmulatedError
from pipeline.emulation.places import COLUMNS
from pipeline.emulation.sampled import Sampled
from pipeline.emulation.thresholds import SIZES, exceedance_of, limit_of, unsettled_share, with_errors
from pipeline.hazard.quantities import QUANTITIES, Quantity
from pipeline.hints import meant
from pipeline.scenario.design import ChosenRuns
from pipeline.settings.settings import Settings
from solver.emulator import support
from solver.emulator.choice import most_telling
from solver.emulator.exceedance import Exceedance
from solver.emulator.fields import Chosen, choose

Array = NDArray[np.float64]
# draws that runs are chosen among
DRAWS = 16384
FORM = re.compile(
    r"(?P<place>.+):\s*(?P<quantity>\w+)\s*>\s*(?P<number>[0-9.]+(e[-+]?[0-9]+)?)\s*(?P<unit>.*)"
)


@dataclass(frozen=True)
class Target:
    """A threshold of a quantity at a receptor; ``str()`` gives it as it is written.

    Parameters
    ----------
    receptor : str
        Its name.
    quantity : Quantity
        What is looked at.
    threshold : float
        In the units of the quantity.
    """

    receptor: str
    quantity: Quantity
    threshold: float

    def __str__(self) -> str:
        return f"{self.receptor}: {self.quantity.name} > {self.threshold:g}"


def target_of(text: str, settings: Settings) -> Target:
    """Read a target as ``school: depth > 1.2``.

    Raises
    ------
    ValueError
        If it is none of the scenario's; the message says what was expected.
    """
    found = FORM.fullmatch(text.strip())
    if found is None:
        raise ValueError(
            f"expected a place, a quantity and a threshold as 'school: depth > 1.2', found '{text}'"
        )
    known = {each.name: each for each in QUANTITIES if each.name in COLUMNS}
    places = [each.name for each in settings.places]
    place, name, unit = found["place"].strip(), found["quantity"], found["unit"].strip()
    if not places:
        raise ValueError(f"expected a scenario with receptors, found none in {settings.name}")
    if place not in places:
        raise ValueError(f"expected a receptor of {', '.join(places)}, found '{place}'{meant(place, places)}")
    if name not in known:
        raise ValueError(f"expected one of {', '.join(known)}, found '{name}'{meant(name, known)}")
    quantity = known[name]
    if unit not in ("", quantity.units):
        raise ValueError(f"expected a number in {quantity.units}, found '{found['number']} {unit}'")
    try:
        threshold = float(found["number"])
    except ValueError:
        threshold = 0.0
    if not 0 < threshold < float("inf"):
        raise ValueError(f"expected a threshold above 0, found '{found['number']}'")
    return Target(place, quantity, threshold)


def chosen_runs(runs: Sampled, target: Target, count: int) -> ChosenRuns:
    """Choose the runs that would tell most of a probability.

    Raises
    ------
    NotEmulatedError
        If leave-one-out does not support what is emulated at the receptor.
    """
    emulator, unsettled = _emulator(runs, target)
    words = _unsupported(emulator)
    if words:
        raise NotEmulatedError(f"{target}: leave-one-out does not support choosing runs: {words}")
    rows = most_telling(emulator.levels, emulator.level, runs.inputs.draws(DRAWS), count)
    if not rows.size:
        raise NotEmulatedError(f"{target}: every place of the sample is a run already")
    origin = f"{runs.words}: {_told(_probability(runs, emulator), unsettled)}"
    return ChosenRuns(str(target), runs.inputs.values(DRAWS, rows), origin)


def known_of(runs: Sampled, target: Target) -> str:
    """Say what the runs give of a target: ``probability 0.016, error 0.004``, or why nothing."""
    emulator, unsettled = _emulator(runs, target)
    verdict = support.of_exceedance(emulator.score)
    return verdict.refused or _told(_probability(runs, emulator), unsettled)


def probability_of(runs: Sampled, target: Target) -> Exceedance:
    """Give the probability of a target, whatever leave-one-out says."""
    return _probability(runs, _emulator(runs, target)[0])


def _emulator(runs: Sampled, target: Target) -> tuple[Chosen, Array | float]:
    """Emulator of what reaches the receptor, and what runs that were overrun or cut off may add to it.

    Raises
    ------
    NotEmulatedError
        If the field is not kept, or the threshold is too low to be told from dry.
    """
    name = target.quantity.field
    if name not in runs.stores[0]:
        raise NotEmulatedError(f"{target}: expected {name}, which output.fields leaves out")
    limit = limit_of(target.quantity, target.threshold, runs.density)
    weight = runs.judged(runs.usable[0])
    fields = runs.fields(name, of_pressure=target.quantity.name == "pressure")
    _, places = choose(fields, [limit], weight, SIZES[name], mapped=False)
    if (target.receptor, limit) not in places:
        raise NotEmulatedError(
            f"{target}: a threshold of {target.threshold:g} is too low to be told from dry"
        )
    return places[target.receptor, limit], unsettled_share(runs, fields, limit, target.receptor)


def _unsupported(emulator: Chosen) -> str:
    """Say why runs cannot be chosen by an emulator; empty where they can.

    A rare threshold is exceeded by few of the runs or none, so that its Brier score says little: then the
    values themselves must be predicted, and without a jump.
    """
    refused = support.of_exceedance(emulator.score).refused
    if not refused or emulator.of_values is None:
        return refused
    values = support.of_scalar(emulator.of_values)
    return "; ".join([refused, values.reason]) if values.refused or values.warned else ""


def _probability(runs: Sampled, emulator: Chosen) -> Exceedance:
    return exceedance_of(runs, emulator, runs.inputs.draws(DRAWS))


def _told(found: Exceedance, unsettled: Array | float) -> str:
    held = {ending: float(value[0]) for ending, value in with_errors(found, unsettled=unsettled).items()}
    told = f"probability {held['']:.4f}, error {held['_error']:.4f}"
    if held["_upper"] == held[""]:
        return told
    return f"{told}, up to {held['_upper']:.4f} with the runs that were overrun or cut off"
