"""Runs that are stopped and go on, and what keeps their snapshots."""

from __future__ import annotations

import copy

import numpy as np
from scenes import SCENES

from solver.physics.friction import Coulomb
from solver.physics.terrain import Plane
from solver.points.cloud import random_points
from solver.points.lattice import Lattice
from solver.scene import Collocation, Scene, WeightedResidual

ARRAYS = (
    "depth",
    "velocity_x",
    "velocity_y",
    "max_depth",
    "max_speed",
    "max_momentum_flux",
    "arrival_time",
    "deposit_depth",
)


class Memory:
    """Keeps every snapshot, and gives the one it is told to."""

    every = 0.0

    def __init__(self, given=None):
        self.saved, self.given = [], given

    def load(self):
        return self.given

    def save(self, snapshot):
        self.saved.append(copy.deepcopy(snapshot))


def assert_same(one, two):
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(one, name).view("i8"), getattr(two, name).view("i8"), name)
    assert (one.ledger, one.steps, one.cell_stages, one.time) == (
        two.ledger,
        two.steps,
        two.cell_stages,
        two.time,
    )
    np.testing.assert_array_equal(one.rest_time, two.rest_time)
    assert one.failure == two.failure


def other(points, scheme):
    x, y = points.coordinates
    depth = np.maximum(0, 1 - ((x - 4) ** 2 + y**2) / 4)
    return Scene(points, Plane(25), depth, 0 * depth, 0 * depth, Coulomb(15), scheme=scheme)


CLOUD = random_points((0, 12), (-4, 4), 400, 5)
CASES = SCENES | {
    "cloud": (other(CLOUD, WeightedResidual()), 1.0),
    "collocation on a cloud": (other(CLOUD, Collocation()), 1.0),
    "collocation on a lattice": (other(Lattice((0, 12), (-4, 4), 0.5), Collocation()), 1.0),
}
