"""Figures of the study beside the limits that were set before, with a margin of 1.5 over a first trial."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from pipeline.studies.emulation.commands import WAYS
from pipeline.studies.emulation.pictures import CLOSE, FINE, FINE_PAIRS, PAIRS, SHIPPED_PAIRS, WIDE
from pipeline.studies.emulation.valley import CHOSEN, FEW, MISSING, RARE

HEAD = ("what", "limit", "measured", "verdict")
ON_TWO = f"64 runs at {WIDE:g} m and {PAIRS} at {CLOSE:g} m"
SHIPPED_LEVELS = f"64 runs at {WIDE:g} m and {SHIPPED_PAIRS} at {CLOSE:g} m"
ON_FINEST = f"64 runs at {WIDE:g} m and {FINE_PAIRS} at {FINE:g} m"


def acceptance(tables: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Table each limit, what was measured and whether it is kept.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        Of the valley, by the names of their parts; what is not there is not judged.
    """
    rows: list[tuple[str, str, str, str]] = []
    if "maps" in tables:
        rows += _maps(tables["maps"].set_index("what"))
    if "receptors" in tables:
        house = tables["receptors"].set_index("what").loc[["house above 0.1 m"]]
        rows.append(_least("house above 0.1 m, a jump: coverage", [0.9], house["coverage"]))
    if "next-runs" in tables:
        words = f"{RARE} m, {FEW} runs and {CHOSEN} chosen"
        chosen = tables["next-runs"].set_index("what").loc[[words]]
        rows.append(_most(f"{words}: error", [0.0015], chosen["rmse"]))
    if "calibrations" in tables:
        held = tables["calibrations"].filter(like="holds_").to_numpy().ravel()
        kept = bool(((held >= 0.84) & (held <= 0.96)).all())
        words = f"{held.min():.2f} to {held.max():.2f}"
        rows.append(
            ("posteriors of 90 %: share that holds the parameter", "0.84 to 0.96", words, _word(kept))
        )
    if "commands" in tables:
        rows += _commands(tables["commands"].set_index("what"))
        if "maps" in tables:
            rows.append(_in_blocks(tables["maps"], tables["commands"]))
    return pd.DataFrame(rows, columns=list(HEAD))


def _maps(table: pd.DataFrame) -> Iterator[tuple[str, str, str, str]]:
    few, some = (table.loc[f"{count} runs at {WIDE:g} m"] for count in (32, 64))
    yield _most("64 runs: error of maps", [0.008, 0.007, 0.004], some["rmse"])
    yield _least(
        "64 runs: error of their share over that of maps", [2.5], some["rmse_of_share"] / some["rmse"]
    )
    for words, part in (("32", few), ("64", some)):
        yield _least(f"{words} runs: coverage of intervals", [0.95], part["coverage"])
        ratio = part["interval"] / part["interval_of_sampling"]
        yield _most(f"{words} runs: width of intervals over that of sampling alone", [0.5], ratio)
    failed = table.loc[f"64 runs at {WIDE:g} m, the {MISSING} largest failed"]
    yield _most(f"the {MISSING} largest of 64 failed: error of maps", [0.025], failed["rmse"])
    yield _least(f"the {MISSING} largest of 64 failed: coverage", [0.9], failed["coverage"])
    yield _most(f"{ON_TWO}, against {CLOSE:g} m: error of maps", [0.012], table.loc[[ON_TWO]]["rmse"])
    yield _most(f"{ON_FINEST}, against {FINE:g} m: error of maps", [0.03], table.loc[[ON_FINEST]]["rmse"])
    beyond = table.loc[[f"{ON_TWO}, against {FINE:g} m"]]
    yield _least(f"{ON_TWO}, against {FINE:g} m: coverage of the total error", [0.9], beyond["coverage"])


def _commands(table: pd.DataFrame) -> Iterator[tuple[str, str, str, str]]:
    for way in WAYS[1:3]:
        emulated = table.loc[[way.words]]
        words = f"{way.words}, over {WAYS[0].words}"
        yield _most(f"{words}: processor time to maps", [1 / 3], emulated["seconds_over_plain"].iloc[:1])
        for spacing in (CLOSE, FINE):
            ratio = emulated[f"rmse_{spacing:g}m_over_plain"]
            yield _most(f"{words}: error of maps against {spacing:g} m", [0.25], ratio)
        ratio = emulated[f"rmse_{CLOSE:g}m_over_independent"]
        yield _most(f"{words} that are independent: error of maps against {CLOSE:g} m", [0.25], ratio)
    emulated = table.loc[[WAYS[1].words]]
    for spacing in (CLOSE, FINE):
        yield _least(
            f"{WAYS[1].words}: coverage of the total error, {spacing:g} m",
            [0.9],
            emulated[f"coverage_{spacing:g}m"],
        )


def _in_blocks(maps: pd.DataFrame, commands: pd.DataFrame) -> tuple[str, str, str, str]:
    """Judge the shipped levels by four blocks of the truth: two seeds differ by a quarter of their errors."""
    plain = commands[commands["what"] == WAYS[0].words].set_index("threshold")
    independent = plain[f"rmse_{CLOSE:g}m"] / plain[f"rmse_{CLOSE:g}m_over_independent"]
    some = maps[maps["what"] == SHIPPED_LEVELS].set_index("threshold")["rmse"]
    words = f"{SHIPPED_LEVELS}, over {WAYS[0].words} that are independent: error of maps over blocks"
    return _most(words, [0.25], some / independent[some.index])


def _most(what: str, limits: Sequence[float], found: ArrayLike) -> tuple[str, str, str, str]:
    values = np.atleast_1d(np.asarray(found, np.float64))
    return what, f"below {_words(limits)}", _words(values), _word(bool((values < limits).all()))


def _least(what: str, limits: Sequence[float], found: ArrayLike) -> tuple[str, str, str, str]:
    values = np.atleast_1d(np.asarray(found, np.float64))
    return what, f"at least {_words(limits)}", _words(values), _word(bool((values >= limits).all()))


def _words(values: ArrayLike) -> str:
    return ", ".join(f"{value:.3g}" for value in np.asarray(values, np.float64))


def _word(kept: bool) -> str:
    return "pass" if kept else "**fail**"
