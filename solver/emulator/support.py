"""What leave-one-out does not support: which numbers are refused or warned of, and by which figure."""

from __future__ import annotations

from dataclasses import dataclass
from math import isnan

import numpy as np
from numpy.typing import NDArray

from solver.emulator.kriging import independent
from solver.emulator.scores import ExceedanceScore, ScalarScore

# of runs of the coarsest level, all and by input
LEAST_RUNS, RUNS_AN_INPUT = 32, 10
# of runs of a finer level
LEAST_PAIRS, FEW_PAIRS = 4, 8
# of the Brier score of the share of the runs
REFUSED_RATIO, DOUBTFUL_RATIO = 0.25, 0.15
LEAST_Q2, LEAST_COVERAGE, WORST = 0.9, 0.8, 5.0


@dataclass(frozen=True)
class Verdict:
    """Whether a number is given.

    Parameters
    ----------
    refused : str
        Why not, empty where it is.
    warned : tuple of str
        What makes it doubtful.
    noted : str
        What else to know.
    """

    refused: str = ""
    warned: tuple[str, ...] = ()
    noted: str = ""

    @property
    def word(self) -> str:
        """``supported``, ``doubtful`` or ``refused``."""
        if self.refused:
            return "refused"
        return "doubtful" if self.warned else "supported"

    @property
    def reason(self) -> str:
        """Why it is refused or doubtful."""
        return self.refused or "; ".join(filter(None, [*self.warned, self.noted]))


def of_runs(runs: int, inputs: int) -> str:
    """Say why so many runs of the coarsest level are too few; empty where they are not."""
    least = max(LEAST_RUNS, RUNS_AN_INPUT * inputs)
    if runs >= least:
        return ""
    return f"expected at least {least} computed runs for {inputs} inputs, found {runs}"


def of_places(inputs: NDArray[np.float64]) -> str:
    """Say why the places of runs, (n, inputs), do not do; empty where they vary in each input by itself."""
    if independent(inputs):
        return ""
    return f"{len(inputs)} runs do not vary in all of {inputs.shape[1]} inputs, each by itself"


def of_pairs(pairs: int) -> tuple[bool, str]:
    """Whether so many runs of a finer level correct the coarser one, and what to warn of."""
    if pairs < LEAST_PAIRS:
        return False, f"{pairs} runs of the finer spacing are too few for a correction ({LEAST_PAIRS})"
    return True, f"{pairs} runs of the finer spacing are few ({FEW_PAIRS})" if pairs < FEW_PAIRS else ""


def of_exceedance(score: ExceedanceScore) -> Verdict:
    """Judge probabilities by their leave-one-out score."""
    if isnan(score.ratio):
        return Verdict("all runs are alike at every place")
    words = f"Brier ratio {score.ratio:.2f}"
    if score.ratio > REFUSED_RATIO:
        return Verdict(f"{words} above {REFUSED_RATIO:g}")
    return Verdict(warned=(f"{words} above {DOUBTFUL_RATIO:g}",) if score.ratio > DOUBTFUL_RATIO else ())


def of_scalar(score: ScalarScore) -> Verdict:
    """Judge a quantity by the leave-one-out score of its values."""
    if not score.q2 >= LEAST_Q2:
        return Verdict(f"Q2 {score.q2:.2f} below {LEAST_Q2:g}")
    return Verdict(warned=jumps(score))


def jumps(score: ScalarScore) -> tuple[str, ...]:
    """Say what looks like a jump of a quantity, which no smooth emulator follows."""
    found = []
    if score.coverage < LEAST_COVERAGE:
        found.append(f"{100 * score.coverage:.0f} % within 95 % intervals: a jump")
    if score.worst > WORST:
        found.append(f"an error of {score.worst:.1f} deviations: a jump")
    return tuple(found)
