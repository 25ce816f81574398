"""Depth-averaged granular flow by local moving least squares: arrays in, arrays out.

The names below are the public face; each is imported when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from solver.forms import prepare as prepare
    from solver.inflow.conditions import Inflow as Inflow
    from solver.inflow.conditions import Section as Section
    from solver.inflow.hydrograph import Hydrograph as Hydrograph
    from solver.inflow.hydrograph import Triangle as Triangle
    from solver.parameters import ParameterError as ParameterError
    from solver.physics.earth_pressure import Isotropic as Isotropic
    from solver.physics.earth_pressure import MohrCoulomb as MohrCoulomb
    from solver.physics.elevation import ElevationModel as ElevationModel
    from solver.physics.erosion import Egashira as Egashira
    from solver.physics.erosion import ErodibleBed as ErodibleBed
    from solver.physics.erosion import ErosionLimits as ErosionLimits
    from solver.physics.erosion import ErosionZone as ErosionZone
    from solver.physics.erosion import GrowthRate as GrowthRate
    from solver.physics.erosion import JumpCondition as JumpCondition
    from solver.physics.erosion import ShearStress as ShearStress
    from solver.physics.erosion import ShearWork as ShearWork
    from solver.physics.friction import Bingham as Bingham
    from solver.physics.friction import Chezy as Chezy
    from solver.physics.friction import Coulomb as Coulomb
    from solver.physics.friction import Edwards as Edwards
    from solver.physics.friction import HerschelBulkley as HerschelBulkley
    from solver.physics.friction import Manning as Manning
    from solver.physics.friction import OBrien as OBrien
    from solver.physics.friction import Pouliquen as Pouliquen
    from solver.physics.friction import Voellmy as Voellmy
    from solver.physics.terrain import Bend as Bend
    from solver.physics.terrain import Plane as Plane
    from solver.physics.terrain import Segment as Segment
    from solver.physics.terrain import Segments as Segments
    from solver.physics.terrain_table import Table as Table
    from solver.points.cloud import PointCloud as PointCloud
    from solver.points.cloud import given_points as given_points
    from solver.points.cloud import graded_points as graded_points
    from solver.points.cloud import random_points as random_points
    from solver.points.lattice import Lattice as Lattice
    from solver.points.spacing import Refinement as Refinement
    from solver.release.initial_state import initial_state as initial_state
    from solver.release.shapes import Box as Box
    from solver.release.shapes import Cap as Cap
    from solver.release.shapes import Cylinder as Cylinder
    from solver.release.shapes import Hemisphere as Hemisphere
    from solver.release.shapes import Paraboloid as Paraboloid
    from solver.result import Failure as Failure
    from solver.result import Ledger as Ledger
    from solver.result import Result as Result
    from solver.scene import Boundaries as Boundaries
    from solver.scene import Scene as Scene
    from solver.scene import Zone as Zone
    from solver.scheme import Collocation as Collocation
    from solver.scheme import WeightedResidual as WeightedResidual
    from solver.simulation import simulate as simulate
    from solver.warmup import compile_kernels as compile_kernels

_PLACES = {
    "solver.forms": ("prepare",),
    "solver.inflow.conditions": ("Inflow", "Section"),
    "solver.inflow.hydrograph": ("Hydrograph", "Triangle"),
    "solver.parameters": ("ParameterError",),
    "solver.physics.elevation": ("ElevationModel",),
    "solver.physics.earth_pressure": ("Isotropic", "MohrCoulomb"),
    "solver.physics.friction": (
        *("Bingham", "Chezy", "Coulomb", "Edwards", "HerschelBulkley", "Manning", "OBrien", "Pouliquen"),
        "Voellmy",
    ),
    "solver.physics.erosion": (
        "Egashira",
        "ErodibleBed",
        "ErosionLimits",
        "ErosionZone",
        "GrowthRate",
        "JumpCondition",
        "ShearStress",
        "ShearWork",
    ),
    "solver.physics.terrain": ("Bend", "Plane", "Segment", "Segments"),
    "solver.physics.terrain_table": ("Table",),
    "solver.points.cloud": ("PointCloud", "given_points", "graded_points", "random_points"),
    "solver.points.lattice": ("Lattice",),
    "solver.points.spacing": ("Refinement",),
    "solver.release.initial_state": ("initial_state",),
    "solver.release.shapes": ("Box", "Cap", "Cylinder", "Hemisphere", "Paraboloid"),
    "solver.result": ("Failure", "Ledger", "Result"),
    "solver.scene": ("Boundaries", "Scene", "Zone"),
    "solver.scheme": ("Collocation", "WeightedResidual"),
    "solver.simulation": ("simulate",),
    "solver.warmup": ("compile_kernels",),
}
_MODULE_OF = {name: module for module, names in _PLACES.items() for name in names}

__all__ = sorted(_MODULE_OF)


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(_MODULE_OF[name]), name)
    return value


def __dir__() -> list[str]:
    """List the public names."""
    return list(__all__)
