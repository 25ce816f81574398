"""Small scenes for the schemes, each with the time it is run to, s."""

from dataclasses import replace

import numpy as np

from solver.kernels.state import Material
from solver.physics.earth_pressure import MohrCoulomb
from solver.physics.friction import Coulomb, Voellmy
from solver.physics.resistance import DryTurbulent
from solver.physics.terrain import Bend, Plane
from solver.points.lattice import Lattice
from solver.scene import Boundaries, Scene, WeightedResidual

LATTICE = Lattice((0, 12), (-4, 4), 0.5)


def heap(lattice, centre, radius, height):
    x, y = np.meshgrid(lattice.x_points, lattice.y_points)
    return height * np.maximum(0, 1 - ((x - centre[0]) ** 2 + (y - centre[1]) ** 2) / radius**2)


SLOPE, FRICTION = Plane(30), Coulomb(20)


def scene(terrain=SLOPE, friction=FRICTION, heaps=(((3, 0.3), 2.5, 1.0),), speed=(0, 0), **changes):
    """Heaps of (centre, radius, height), with a sheared initial velocity."""
    lattice = changes.pop("lattice", LATTICE)
    depth = sum(heap(lattice, *h) for h in heaps)
    shear = 1 + 0.1 * np.sin(2 * lattice.x_points + lattice.y_points[:, None])
    return Scene(lattice, terrain, depth, speed[0] * shear, speed[1] * shear, friction, **changes)


def rough(seed, **changes):
    """Depths over five decades, every third cell dry or at rest, velocities of either sign."""
    rng = np.random.default_rng(seed)
    shape = LATTICE.shape
    depth = 10.0 ** rng.uniform(-5, 0, shape) * (rng.random(shape) < 2 / 3)
    velocity = rng.normal(0, 3, (2, *shape)) * (rng.random(shape) < 2 / 3)
    return replace(Scene(LATTICE, Plane(20), depth, *velocity, Coulomb(15)), **changes)


def material(law, friction=0.0, dry=0.0):
    """What kernels are given of a law of earth pressure."""
    return Material(DryTurbulent(friction, 0.0), law.coefficients(), law.transition(), dry)


def all_sides(side):
    return Boundaries(side, side, side, side)


MIXED = Boundaries(x_min="no-slip", x_max="open", y_min="wall", y_max=0.3)
TWO, FOUR = (((3, 0), 2.9, 0.3), ((5, 1), 1.2, 0.8)), tuple(((1 + 3 * k, k - 2), 1.1, 0.5) for k in range(4))
LONG = WeightedResidual(cfl=1.8)
SCENES = {
    "frictionless": (scene(friction=Coulomb(0), speed=(1, 0.5)), 1.0),
    "earth pressure jumps": (scene(earth_pressure=MohrCoulomb(40, 20), speed=(2, -1)), 1.0),
    "curvature": (scene(Bend(40, start=3, end=9), Coulomb(25), speed=(3, 0)), 1.0),
    "drag": (scene(friction=Voellmy(10, 50.0), speed=(2, 1)), 1.0),
    "walls": (scene(speed=(-3, 4), boundaries=all_sides("wall")), 1.0),
    "no-slip": (scene(speed=(-3, 4), boundaries=all_sides("no-slip")), 1.0),
    "given depth": (scene(Plane(0), heaps=(((6, 0), 2, 0.1),), boundaries=all_sides(0.5)), 1.5),
    "mixed sides": (scene(Plane(10), boundaries=MIXED, speed=(-2, 3)), 1.5),
    "partly at rest": (scene(Plane(20), Coulomb(25), TWO, earth_pressure=MohrCoulomb(35, 25)), 2.0),
    "several blobs": (scene(Plane(25), heaps=FOUR), 1.5),
    "leaving the domain": (scene(heaps=(((10, 3), 2.5, 1.0),), speed=(4, 3)), 2.5),
    "rough": (rough(1), 0.4),
    "rough, long steps": (rough(2, scheme=WeightedResidual(cfl=1.8)), 0.3),
    "rough, long steps, walls": (
        rough(4, scheme=WeightedResidual(cfl=1.8), boundaries=all_sides("wall")),
        0.3,
    ),
    "coming to rest": (scene(Plane(5), Coulomb(35), speed=(1, 0), earth_pressure=MohrCoulomb(38, 35)), 3.0),
}
