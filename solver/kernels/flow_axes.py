"""Earth pressure with the axes of the flow: a symmetric tensor, the same in every frame.

Eqs. 8 and 9 are of a Mohr circle with the basal shear ``tan(delta)`` along x. The bed drags against the flow:
their axis is the direction of the flow, and of what drives it where it is slow. With A the share that each
direction has in the basal traction, a symmetric tensor of trace 1 (``s s^T`` where it moves along s),

    K = K_along A + K_across (1 - A),

and the states are chosen by the rates of stretching ``A : D`` and ``(1 - A) : D``, D the strain rate.
"""

from __future__ import annotations

from solver.arrays import Array
from solver.compiled import kernel
from solver.kernels.earth_pressure import earth_pressure, lean_of
from solver.kernels.state import Material
from solver.physics.earth_pressure import STEEPEST

# A symmetric tensor in a frame: xx, yy, xy. A vector: x, y.
Tensor = tuple[float, float, float]
Vector = tuple[float, float]


@kernel(inline=True)
def traction_axes(velocity: Vector, h: float, pull: Vector, normal: float, rise: Vector, wet: bool) -> Tensor:
    """Share A of the directions in the basal traction, dimensionless.

    It is ``u u^T + g cos(xi) h (t t^T + p p^T)`` over its trace, with t the slope of the bed, its tangent,
    and p that of the depth, up to 1. In a sum of squares nothing cancels: it is zero only where a layer of
    constant depth is at rest on level ground. There, and for what is dry, all directions count as along the
    flow, which is the way that it will be pushed.

    Parameters
    ----------
    velocity : tuple
        m s-1.
    h : float
        Depth, m.
    pull : tuple
        Gravity along the bed, m s-2.
    normal : float
        g cos(xi), m s-2.
    rise : tuple
        Slope of the depth, dimensionless.
    wet : bool
        Whether the cell is.
    """
    u, v = velocity
    g_x, g_y = pull
    h_x, h_y = rise
    steep = h_x * h_x + h_y * h_y
    of_bed, of_depth = h / normal, h * normal / (steep if steep > 1.0 else 1.0)
    xx = u * u + of_bed * (g_x * g_x) + of_depth * (h_x * h_x)
    yy = v * v + of_bed * (g_y * g_y) + of_depth * (h_y * h_y)
    xy = u * v + of_bed * (g_x * g_y) + of_depth * (h_x * h_y)
    total = xx + yy
    known = wet & (total > 0.0)
    total = total if known else 1.0
    return xx / total if known else 1.0, yy / total if known else 1.0, xy / total if known else 0.0


@kernel(inline=True)
def rise_along(axes: Tensor, rise: Vector) -> Vector:
    """Part of a slope of the depth that is along the flow; the rest is across it."""
    xx, yy, xy = axes
    return xx * rise[0] + xy * rise[1], xy * rise[0] + yy * rise[1]


@kernel(inline=True)
def strain_along_axes(
    axes: Tensor,
    mean_x: Vector,
    mean_y: Vector,
    half_x: Vector,
    half_y: Vector,
    rise: Vector,
    slope: Tensor,
) -> tuple[float, float]:
    """Rates of stretching along and across the flow on a lattice, s-1, as `stretching` has them of one axis.

    What arrives comes from the deeper side. In the direction of an axis e the waves of its state run by
    ``e (e . grad h)``, so that the component of this along a row decides which side of the row counts.

    Parameters
    ----------
    mean_x, mean_y, half_x, half_y : tuple
        Derivatives of u and v along the rows and along the columns, s-1: the means of those on both sides,
        and half of the one ahead less the other.
    rise : tuple
        Slope of the depth in the frame of the cell.
    slope : tuple
        p, r, q: a derivative in the frame of the cell is ``(p d_x, r d_x + q d_y)``; (1, 0, 1) on a plane.
    """
    xx, yy, xy = axes
    p, r, q = slope
    a_x, a_y = rise_along(axes, rise)
    b_x, b_y = rise[0] - a_x, rise[1] - a_y
    # of the derivatives of u and v along rows, and along columns
    of_ux, of_vx, of_uy, of_vy = p * xx + r * xy, p * xy + r * yy, q * xy, q * yy
    along = (of_ux * mean_x[0] + of_vy * mean_y[1]) + (of_uy * mean_y[0] + of_vx * mean_x[1])
    along += lean_of(p * a_x + r * a_y) * (of_ux * half_x[0] + of_vx * half_x[1])
    along += lean_of(q * a_y) * (of_vy * half_y[1] + of_uy * half_y[0])
    of_ux, of_vx = p * (1.0 - xx) - r * xy, r * (1.0 - yy) - p * xy
    of_uy, of_vy = -(q * xy), q * (1.0 - yy)
    across = (of_ux * mean_x[0] + of_vy * mean_y[1]) + (of_uy * mean_y[0] + of_vx * mean_x[1])
    across += lean_of(p * b_x + r * b_y) * (of_ux * half_x[0] + of_vx * half_x[1])
    across += lean_of(q * b_y) * (of_vy * half_y[1] + of_uy * half_y[0])
    return along, across


@kernel(inline=True)
def pressure_along_axes(
    axes: Tensor,
    along: float,
    across: float,
    decrease: float,
    normal: float,
    rise: Vector,
    material: Material,
) -> tuple[float, float, float, float, float]:
    """Give ``g cos xi K`` as a tensor, and half the speed of the waves of the states along x and y.

    Parameters
    ----------
    axes : tuple
        From `traction_axes`.
    along, across : float
        Rates of stretching along the flow and across it, s-1.
    decrease, normal, material
        As of `solver.kernels.earth_pressure.earth_pressure`.
    rise : tuple
        Slope of the depth.

    Returns
    -------
    beta_x, beta_y, beta_xy : float
        g cos(xi) K, m s-2.
    wave_x, wave_y : float
        m s-1, of slopes up to `STEEPEST`.
    """
    xx, yy, xy = axes
    b_s, b_n, wave_s, wave_n = earth_pressure(along, across, decrease, normal, STEEPEST, STEEPEST, material)
    a_x, a_y = rise_along(axes, rise)
    wave_x = wave_s * up_to_steepest(a_x) + wave_n * up_to_steepest(rise[0] - a_x)
    wave_y = wave_s * up_to_steepest(a_y) + wave_n * up_to_steepest(rise[1] - a_y)
    return (
        b_s * xx + b_n * (1.0 - xx),
        b_s * yy + b_n * (1.0 - yy),
        (b_s - b_n) * xy,
        wave_x,
        wave_y,
    )


@kernel(inline=True)
def up_to_steepest(rise: float) -> float:
    """Size of a component of a slope, up to `STEEPEST`, as a part of it."""
    size = abs(rise) * (1.0 / STEEPEST)
    return size if size < 1.0 else 1.0


@kernel(inline=True)
def sheared(shear: Array | None, i: int, x: float, y: float) -> Vector:
    """Multiply a vector by the shear of the pressure tensor of cell i; 0 without ``beta_xy``."""
    if shear is None:
        return 0.0, 0.0
    return shear[i] * y, shear[i] * x


@kernel(inline=True)
def normal_pressure(shear: Array | None, i: int, b_x: float, b_y: float, n_x: float, n_y: float) -> float:
    """Give the pressure of cell i on a face with a unit normal, g cos(xi) K, m s-2."""
    along_axes = b_x * (n_x * n_x) + b_y * (n_y * n_y)
    if shear is not None:
        along_axes += 2.0 * shear[i] * (n_x * n_y)
    return along_axes
