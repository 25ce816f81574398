"""What every law of basal friction answers: kernels that are chosen by the class of the law.

Every law is a resistance ``R(s, h) = tau_b / (rho h)``, one of the forms of `solver.physics.resistance`.
A stage of duration D leaves a cell with ``q*`` without friction. With ``r = |q*|/h - D R(0, h)`` the cell
stops exactly if ``r <= 0``; its speed s solves ``s + D (R(s, h) - R(0, h)) = r`` otherwise. Resistance at
rest acts on the depth that gravity acts on. `solver.kernels.friction` has the answers.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from solver.compiled import by_type, kernel
from solver.physics.resistance import Resistance, Uniform

# Number of a cell.
Index = int | np.unsignedinteger[Any]


@by_type
def law_at(law: Resistance, i: Index) -> Uniform:
    """Law of a cell: the law itself, or that of the cell with number i where there are zones.

    Parameters
    ----------
    law : named tuple
        One of `solver.physics.resistance`.
    i : int
        Number of the cell in the flat arrays of the run.
    """
    raise NotImplementedError


@by_type
def rest_stress(law: Uniform, h: float, load: float, pressure: float) -> float:
    """Basal stress over density that holds what is at rest, ``h R(0, h)``, m2 s-2.

    Parameters
    ----------
    law : named tuple
        One of `solver.physics.resistance`.
    h, load : float
        Depth, and depth that gravity acts on, m.
    pressure : float
        Normal load N, m s-2.
    """
    raise NotImplementedError


@by_type
def resistance(law: Uniform, speed: float, h: float, pressure: float) -> float:
    """Basal resistance ``R(s, h) = tau_b / (rho h)``, m s-2.

    Parameters
    ----------
    law : named tuple
        One of `solver.physics.resistance`.
    speed, h : float
        Speed s, m s-1, and depth, m, above 0.
    pressure : float
        Normal load N, m s-2.
    """
    raise NotImplementedError


@by_type
def share_left(law: Uniform, speed: float, h: float, load: float, pressure: float, time: float) -> float:
    """Share s/r of a speed r that is left, r what resistance at rest has left.

    Parameters
    ----------
    law : named tuple
        One of `solver.physics.resistance`.
    speed : float
        r, m s-1, above 0.
    h, load : float
        Depth, and depth that gravity acts on, m.
    pressure : float
        Normal load N, m s-2.
    time : float
        Time that friction acts, s.
    """
    raise NotImplementedError


@by_type
def held_momentum(law: Uniform, h: float, load: float, pressure: float, time: float) -> float:
    """Momentum that resistance at rest takes at most, m2 s-1; parameters as of `share_left`."""
    raise NotImplementedError


@by_type
def slowed(
    law: Uniform, u: float, v: float, h: float, load: float, pressure: float, time: float
) -> tuple[float, float]:
    """Velocity that is left of what resistance at rest has left, m s-1; parameters as of `share_left`."""
    raise NotImplementedError


@by_type
def below_yield(law: Uniform, drive_x: float, drive_y: float, h: float, normal: float) -> bool:
    """Whether friction balances a driving acceleration, so that what is at rest stays at rest.

    Parameters
    ----------
    law : named tuple
        One of `solver.physics.resistance`.
    drive_x, drive_y : float
        Pressure gradient less gravity along and across, ``beta h_x - g sin xi``, m s-2.
    h : float
        Depth, m: at a face, the mean of the two cells.
    normal : float
        g cos(xi), m s-2.
    """
    raise NotImplementedError


@by_type
def faces_below_yield(
    law: Uniform,
    back: tuple[float, float],
    forth: tuple[float, float],
    h: float,
    behind: tuple[float, float],
    ahead: tuple[float, float],
    normal: float,
) -> bool:
    """Whether friction balances the drive at each of the four faces of a cell, as `below_yield`.

    Parameters
    ----------
    law : named tuple
        One of `solver.physics.resistance`.
    back, forth : tuple
        Drive at the low and high faces along x and y, m s-2. At a face along x the mean drive of the cell
        along y counts, and the other way round.
    h : float
        Depth of the cell, m.
    behind, ahead : tuple
        Depths beyond its low and high faces along x and y, m.
    normal : float
        g cos(xi), m s-2.
    """
    raise NotImplementedError


@by_type
def mean_drive(law: Uniform, back: float, forth: float, h_back: float, h_forth: float, h: float) -> float:
    """Mean of what drives the two faces of a cell along an axis, as `below_yield` compares it.

    Where the yield is a stress it is that of the stresses, per depth of the cell: what stands at the limit at
    each face would exceed it in the mean of accelerations. A cell thinner than its faces in the mean counts
    as deep as these.

    Parameters
    ----------
    law : named tuple
        One of `solver.physics.resistance`.
    back, forth : float
        Drive at the faces, m s-2.
    h_back, h_forth, h : float
        Depths at the faces and of the cell, m.
    """
    raise NotImplementedError


@by_type
def raised_rate(law: Uniform, rate: float, h: float, normal: float, dry: float) -> float:
    """Wave rate of a cell, s-1, raised where the law limits the step.

    Parameters
    ----------
    law : named tuple
        One of `solver.physics.resistance`.
    rate : float
        Wave rate without, s-1.
    h, normal, dry : float
        Depth, m; g cos(xi), m s-2; depth up to which a cell counts as dry, m.
    """
    raise NotImplementedError


@kernel(inline=True)
def loaded(h: float, load: float) -> float:
    """Share of a yield stress that acts where gravity has acted on the depth ``load`` of h, m.

    Without it fresh material at a front would feel all of the yield stress before its own weight.
    """
    return load / h if load < h else 1.0
