"""Earth pressure (eqs. 7, 10 and 11): how the coefficient follows from the velocity gradient."""

from __future__ import annotations

from solver.compiled import kernel
from solver.kernels.state import Material


@kernel(inline=True)
def earth_pressure(
    u_x: float, v_y: float, round_off: float, h: float, normal: float, material: Material
) -> tuple[float, float]:
    """Choose the active coefficient where the flow extends and the passive one where it shortens.

    A dry cell counts as extending.

    Parameters
    ----------
    u_x, v_y : float
        Gradients of the velocity along and across, s-1. A dry neighbour has no velocity to differ by.
    round_off : float
        Size up to which a gradient counts as none, s-1.
    h : float
        Depth, m.
    normal : float
        g cos(xi), m s-2.
    material : Material
        Coefficients and the dry limit.

    Returns
    -------
    beta_x, beta_y : float
        g cos(xi) K along and across, m s-2.
    """
    x_a, x_p, y_aa, y_ap, y_pa, y_pp = material.pressure
    dry = h <= material.dry
    extends_x, extends_y = (u_x >= -round_off) | dry, (v_y >= -round_off) | dry
    k_active, k_passive = y_aa if extends_y else y_ap, y_pa if extends_y else y_pp
    return normal * (x_a if extends_x else x_p), normal * (k_active if extends_x else k_passive)
