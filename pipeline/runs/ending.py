"""How a run ended: at rest within the domain, with material lost through open sides, or while it moved."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from pipeline.readable import percent
from pipeline.runs.summary import overrun, whole
from pipeline.store.variables import Status

if TYPE_CHECKING:
    from solver.result import Result

# Shares of the volume, released, come in or entrained. So little lost through open sides is a drop.
DROP = 1e-4
# A run of which no more moves at its end is done: films of Voellmy friction creep on for ever. What moves is
# faster than a Froude number of `solver.simulation.MOVING`.
MOVING_SHARE = 0.02


def status(result: Result) -> Status:
    """Say what became of a run."""
    if result.failure is not None:
        return Status.FAILED
    volume = result.ledger.total
    lost = result.ledger.outflow_open > DROP * volume
    moving = result.moving_volume > MOVING_SHARE * volume
    if moving:
        return Status.OVERRUN_AND_CUT_OFF if lost else Status.CUT_OFF
    return Status.OVERRUN if lost else Status.DONE


def volumes(result: Result) -> dict[str, float]:
    """Give what decides the status, by name of variable: volumes, m3, and a share; none of a failed run."""
    if result.failure is not None:
        return {}
    out, total = result.ledger.outflow_open, result.ledger.total
    share = out / total if total > 0 else 0.0
    return {"volume_out_open": out, "share_out": share, "volume_moving": result.moving_volume}


def reason(status: Status, row: Mapping[str, Any]) -> str:
    """Say why a run failed, how far it was overrun, and how much of it was still moving."""
    said = []
    if status.is_overrun:
        said.append(f"{percent(overrun(row))} of the volume left the domain")
    if status.is_cut_off:
        share = row["volume_moving"] / whole(row)
        said.append(f"{percent(share)} of the volume still moves at {row['last_time']:g} s")
    return ", ".join(said) or str(row.get("failure_reason", ""))
