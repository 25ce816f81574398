"""Tables of the report on emulated numbers."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from math import inf, isnan
from typing import Any

from pipeline.assess.probability import in_words
from pipeline.emulation.emulate import Emulated
from pipeline.emulation.errors import NotEmulatedError
from pipeline.readable import number, written
from pipeline.report.tables.table import Table, bounded, short


def emulated_tables(found: Emulated | NotEmulatedError | None) -> list[Table]:
    """Table emulated probabilities at receptors, and what leave-one-out says of the emulator."""
    if found is None:
        return []
    if isinstance(found, NotEmulatedError):
        return [Table("Emulated", ["none"], [], f"This scenario cannot be emulated: {found}.")]
    made = []
    if "emulated-receptors" in found.tables:
        rows = [
            [
                f"{row['receptor']}: {row['quantity']} above {row['threshold']:g} {row['units']}",
                bounded(row, "probability", "probability_lower", "probability_upper"),
                *(number(row[f"emulated{ending}"]) for ending in ("", *ENDINGS)),
                str(row["reason"]) or "supported",
            ]
            for row in found.tables["emulated-receptors"].to_dict("records")
        ]
        head = ["receptor", "of the runs", "emulated", "sampling", "discretisation", "error", "leave-one-out"]
        made.append(Table("Emulated receptors", head, rows, f"{found.comment}. {EMULATED}"))
    if "emulated-scenarios" in found.tables:
        rows = [
            [
                _titled(row),
                _of_runs(row),
                *(short(row[f"emulated{ending}"]) for ending in ("", *ENDINGS)),
                str(row["reason"]) or "supported",
            ]
            for row in found.tables["emulated-scenarios"].to_dict("records")
        ]
        head = ["quantity", "of the runs", "emulated", "sampling", "discretisation", "error", "leave-one-out"]
        made.append(Table("Emulated quantiles", head, rows, f"{found.comment}. {EMULATED}"))
    checks = found.tables["leave-one-out"].to_dict("records")
    shown = ("brier_ratio", "calibration", "q2", "coverage", "worst")
    rows = [[str(row["what"]), str(row["verdict"]), *(number(row[name]) for name in shown)] for row in checks]
    head = ["what", "verdict", "Brier ratio", "calibration", "Q2", "coverage", "worst error"]
    return [*made, Table("Leave-one-out", head, rows, LEFT_OUT)]


def _titled(row: Mapping[Hashable, Any]) -> str:
    name = f"{str(row['quantity']).replace('_', ' ')}, {100 * row['share']:g} % below"
    unit = written(str(row["units"]))
    return f"{name} ({unit})" if unit else name


def _of_runs(row: Mapping[Hashable, Any]) -> str:
    """Write the quantile of the runs with its bounds, of which a missing one is infinite."""
    lower, estimate, upper = (float(row[f"quantile{bound}"]) for bound in ("_lower", "", "_upper"))
    return in_words(-inf if isnan(lower) else lower, estimate, inf if isnan(upper) else upper, short)


ENDINGS = ("_sampling", "_discretisation", "_error")
EMULATED = (
    "Errors are half widths: of the 95 % interval of what few runs leave open, of an allowance for the "
    "spacing, and of both. With one spacing nothing is known of the second."
)
LEFT_OUT = (
    "Each run as predicted from the others. The Brier ratio is the score of predicted probabilities over "
    "that of the plain share: 0 is perfect, above 0.25 they are refused. Q2 is the predicted share of the "
    "variance, coverage the share of runs within 95 % intervals, the worst error in standard deviations."
)
