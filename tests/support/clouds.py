"""Point clouds for property tests: evenly random, graded, a shaken lattice, and points thrown at random."""

import numpy as np
from hypothesis import strategies as st

from solver.points.cloud import given_points, graded_points, random_points
from solver.points.spacing import Refinement


def shaken_lattice(columns, rows, shake, x, y, seed):
    """Points of a lattice that includes the bounds, each moved by up to ``shake`` spacings where it may."""
    rng = np.random.default_rng(seed)
    along, across = (np.linspace(*b, n) for b, n in ((x, columns), (y, rows)))
    points = np.stack(np.meshgrid(along, across), axis=-1).reshape(-1, 2)
    points += shake * rng.uniform(-1, 1, points.shape) * [along[1] - along[0], across[1] - across[0]]
    return given_points(np.clip(points, [x[0], y[0]], [x[1], y[1]]), x, y)


@st.composite
def clouds(draw):
    x0, y0 = draw(st.floats(-50, 50)), draw(st.floats(-50, 50))
    width, height = draw(st.floats(2, 8)), draw(st.floats(2, 8))
    x, y, seed = (x0, x0 + width), (y0, y0 + height), draw(st.integers(0, 2**32))
    kind = draw(st.sampled_from(["random", "graded", "lattice", "shaken", "thrown"]))
    if kind == "random":
        return random_points(x, y, draw(st.integers(60, 300)), seed)
    if kind == "graded":
        region = Refinement((x0, x0 + width / 4), (y0, y0 + height / 3), draw(st.floats(0.15, 0.3)))
        return graded_points(x, y, 0.6, [region], draw(st.floats(0.05, 0.3)), seed)
    if kind == "thrown":
        points = np.random.default_rng(seed).uniform([x[0], y[0]], [x[1], y[1]], (200, 2))
        return given_points(points, x, y)
    spacing = draw(st.floats(0.3, 0.5)) * min(width, height) / 2
    columns, rows = (round(extent / spacing) + 1 for extent in (width, height))
    return shaken_lattice(columns, rows, draw(st.floats(0, 0.3)) if kind == "shaken" else 0.0, x, y, seed)
