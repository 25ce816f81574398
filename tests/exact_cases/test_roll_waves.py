"""Roll waves through the whole scheme: how fast long waves on a uniform flow grow or decay, in one dimension.

On a uniform flow of depth h and speed u, waves ``exp(i k x + s t)`` of depth and speed obey, to first order,
``z^2 + R_u z + g cos(xi) h k^2 = i k h R_h`` with ``z = s + i k u`` and the derivatives of the resistance
R(u, h). The faster root grows above ``u/sqrt(g cos(xi) h) = 1/(d ln u/d ln h)``, and decays below.
"""

import numpy as np
import pytest
from scipy.optimize import brentq

from solver.forms import begin
from solver.kernels.friction import resistance
from solver.physics.constants import GRAVITY as G
from solver.physics.friction import Bingham, Manning, Pouliquen, Voellmy, friction_angle
from solver.physics.terrain import Plane
from solver.points.lattice import Lattice
from solver.scene import Scene

BINGHAM_STOPS, BEADS_STOP = 0.293515, 0.00157327


def voellmy(froude):
    return Voellmy(friction_angle(0.1), G * froude**2 / (np.tan(np.radians(20)) - 0.1)), 20, 1.0


def manning(froude):
    return Manning(float(2 ** (1 / 6) * np.sqrt(np.tan(np.radians(15)) / G) / froude)), 15, 2.0


def pouliquen(froude):
    return Pouliquen((21.0, 30.7), 0.136, 0.65e-3), 24, BEADS_STOP * froude / 0.136


def bingham(times, froude):
    """A layer of so many times the thickness that rests; its speed is as 1 over its viscosity."""
    law, h = Bingham(1000.0, 100.0, density=2000.0), times * BINGHAM_STOPS
    speed = uniform(law, 10, h)[0]
    waves = np.sqrt(G * np.cos(np.radians(10)) * h)
    return Bingham(1000.0, 100.0 * speed / (waves * froude), density=2000.0), 10, h


# flow by its Froude number; Froude numbers below, at and above the listed one
FLOWS = {
    "voellmy": (voellmy, (1.7, 2.0, 2.4)),
    "manning": (manning, (1.2, 1.5, 1.8)),
    "pouliquen": (pouliquen, (0.55, 2 / 3, 0.8)),
    "bingham, twice": (lambda froude: bingham(2, froude), (0.2, 0.263158, 0.33)),
    "bingham, four times": (lambda froude: bingham(4, froude), (0.3, 0.391304, 0.5)),
}


def uniform(law, angle, h):
    """Speed, gravity normal to the bed, R_u and h R_h of the uniform flow."""
    xi, given, step = np.radians(angle), law.resistance(G), 1e-5
    normal = G * np.cos(xi)

    def held(u, depth):
        return resistance(given, u, depth, normal)

    u = brentq(lambda s: G * np.sin(xi) - held(s, h), 1e-9, 1e3, xtol=1e-14, rtol=1e-14)
    by_speed = (held(u * (1 + step), h) - held(u * (1 - step), h)) / (2 * step * u)
    by_depth = (held(u, h * (1 + step)) - held(u, h * (1 - step))) / (2 * step)
    return u, normal, by_speed, by_depth


def wave_of(law, angle, h):
    """A wave in which friction acts for long: its length, and its faster root z."""
    _, normal, by_speed, by_depth = uniform(law, angle, h)
    length = 10 * np.pi * np.sqrt(normal * h) / by_speed
    k = 2 * np.pi / length
    roots = np.roots([1, by_speed, normal * h * k**2 - 1j * k * by_depth])
    return length, roots[roots.real.argmax()]


def rate(law, angle, h, cells, waves=3, size=1e-4):
    """Rate of growth, s-1, that the scheme gives three waves of so many cells each, away from the ends."""
    u, normal, by_speed, _ = uniform(law, angle, h)
    length, z = wave_of(law, angle, h)
    k, spacing, time, fast = 2 * np.pi / length, length / cells, 30 / by_speed, np.sqrt(normal * h)
    # what comes from an end does not reach them
    above = int(np.ceil(1.05 * (u + fast) * time / length)) * cells
    below = int(np.ceil(1.05 * max(0.0, fast - u) * time / length) + 1) * cells
    count = above + waves * cells + below
    row = Lattice((spacing / 2, (count - 0.5) * spacing), (0, 2 * spacing), spacing)
    # means over the cells
    wave = size * np.exp(1j * k * row.x_points) * np.sinc(spacing / length)
    ones = np.ones(row.shape)
    depth, speed = h * (1 + wave.real) * ones, u * (1 + (1j * z / (k * u) * wave).real) * ones
    run = begin(Scene(row, Plane(angle), depth, speed, 0 * ones, law), time, 0.0, True)
    middle = slice(above, above + waves * cells)

    def amplitude():
        return abs(((run.state[0][1] - h) * wave.conj())[middle].mean())

    first = amplitude()
    run.advance(time, None)
    return np.log(amplitude() / first) / time


@pytest.mark.parametrize("flow", FLOWS)
def test_the_listed_froude_number_is_where_waves_neither_grow_nor_decay(flow):
    make, froudes = FLOWS[flow]
    grows = [wave_of(*make(froude))[1].real / uniform(*make(froude))[2] for froude in froudes]
    assert grows[0] < -0.005
    assert grows[1] == pytest.approx(0, abs=1e-6)
    assert grows[2] > 0.01


@pytest.mark.parametrize("side", ["below", "at", "above"])
@pytest.mark.parametrize("flow", FLOWS)
def test_waves_grow_above_the_listed_froude_number_and_decay_below_at_the_rate_of_linear_theory(flow, side):
    make, froudes = FLOWS[flow]
    law, angle, h = make(froudes[("below", "at", "above").index(side)])
    friction, exact = uniform(law, angle, h)[2], wave_of(law, angle, h)[1].real
    found = np.array([rate(law, angle, h, cells) for cells in (32, 64, 128)])
    errors = np.abs(found - exact) / friction
    if side != "at":
        assert (np.sign(found) == np.sign(exact)).all()
    # friction is of first order in the step: twice the cells have half the error, and the limit is exact
    assert errors[-1] < 3e-3
    assert 2 * found[2] - found[1] == pytest.approx(exact, abs=2e-4 * friction)
