"""States of a run, and checks of laws in them."""

from __future__ import annotations

from typing import NamedTuple

from solver.arrays import Array
from solver.run import Run


class State(NamedTuple):
    """A state of a run.

    Parameters
    ----------
    h, u, v : array
        Depth (m) and velocity (m s-1), of the shape of the points.
    time : float
        In s.
    ledger : array
        Volumes that came in and left through each side so far, (4, 2), m3.
    eroded : array or float
        Depth that the bed has lost, of the shape of the points or 0, m.
    entrained : float
        Volume that the flow has taken up, m3.
    entered : float
        Volume of inflows so far, m3.
    """

    h: Array
    u: Array
    v: Array
    time: float
    ledger: Array
    eroded: Array | float = 0.0
    entrained: float = 0.0
    entered: float = 0.0


def state_of_run(run: Run) -> State:
    """Copy the state of a run."""
    eroded = run.eroded if run.scene.erodible_bed is not None else 0.0
    return State(*run.state, run.time, run.ledger.copy(), eroded, run.entrained, run.come_in)


class Check(NamedTuple):
    """A law at one moment; it is kept where the value is at most the limit."""

    law: str
    value: float
    limit: float

    @property
    def kept(self) -> bool:
        """Whether the law is kept; what is not a number does not keep it."""
        return bool(self.value <= self.limit)
