"""Runs that are stopped and go on, and what keeps their snapshots."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
from scenes import SCENES

from solver.forms import begin
from solver.physics.earth_pressure import MohrCoulombFlow
from solver.physics.erosion import Egashira, ErodibleBed, GrowthRate, ShearStress
from solver.physics.friction import Coulomb
from solver.physics.terrain import Plane
from solver.points.cloud import random_points
from solver.points.lattice import Lattice
from solver.scene import Collocation, Scene, WeightedResidual
from solver.verification.surfaces import Inclined

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


def with_and_without_a_restart(scene, end, steps):
    """Two runs of as many steps, the second gone on with from where a third had taken half of them."""
    whole, first, second = (begin(scene, end, 0.01, True) for _ in range(3))
    whole.advance(end, steps)
    first.advance(end, steps // 2)
    second.restore({key: array.copy() for key, array in first.carried.items()})
    second.advance(end, steps)
    return whole, second


def assert_carried_alike(one, two):
    """All that a snapshot of two runs has is the same to the last bit."""
    for name, array in one.carried.items():
        np.testing.assert_array_equal(two.carried[name], array, name)


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
    for name in ("entrained", "erosion_depth", "bed_change"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name), name)


def other(points, scheme):
    x, y = points.coordinates
    depth = np.maximum(0, 1 - ((x - 4) ** 2 + y**2) / 4)
    return Scene(points, Plane(25), depth, 0 * depth, 0 * depth, Coulomb(15), scheme=scheme)


def eroding(case, law):
    """The same on a bed that erodes, the deeper the farther along it."""
    x = case.points.coordinates[0]
    return replace(case, erodible_bed=ErodibleBed(0.02 * np.abs(x), law))


def along_flow(case):
    """The same with Mohr-Coulomb earth pressure that has the axes of the flow."""
    return replace(case, earth_pressure=MohrCoulombFlow(40.0, case.friction.bed_friction))


CLOUD = random_points((0, 12), (-4, 4), 400, 5)
CASES = SCENES | {
    "erosion": (eroding(SCENES["several blobs"][0], GrowthRate(0.1)), 1.5),
    "erosion on a cloud": (
        eroding(other(CLOUD, WeightedResidual()), ShearStress(critical_stress=10.0, density=2000.0)),
        1.0,
    ),
    "erosion on a surface": (
        eroding(replace(SCENES["several blobs"][0], terrain=Inclined(20.0, 25.0)), Egashira()),
        1.5,
    ),
    "cloud": (other(CLOUD, WeightedResidual()), 1.0),
    "pressure along the flow": (along_flow(SCENES["several blobs"][0]), 1.5),
    "pressure along the flow on a surface": (
        along_flow(replace(SCENES["several blobs"][0], terrain=Inclined(20.0, 25.0))),
        1.5,
    ),
    "pressure along the flow on a cloud": (along_flow(other(CLOUD, WeightedResidual())), 1.0),
    "collocation on a cloud": (other(CLOUD, Collocation()), 1.0),
    "collocation on a lattice": (other(Lattice((0, 12), (-4, 4), 0.5), Collocation()), 1.0),
}
