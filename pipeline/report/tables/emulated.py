"""Tables of the report on emulated numbers."""

from __future__ import annotations

from pipeline.emulation.emulate import Emulated
from pipeline.emulation.errors import NotEmulatedError
from pipeline.readable import number
from pipeline.report.tables.table import Table, bounded


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
    checks = found.tables["leave-one-out"].to_dict("records")
    shown = ("brier_ratio", "calibration", "q2", "coverage", "worst")
    rows = [[str(row["what"]), str(row["verdict"]), *(number(row[name]) for name in shown)] for row in checks]
    head = ["what", "verdict", "Brier ratio", "calibration", "Q2", "coverage", "worst error"]
    return [*made, Table("Leave-one-out", head, rows, LEFT_OUT)]


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
