"""The law of friction of a cell: one for all, or by zones."""

from __future__ import annotations

from solver.arrays import Array
from solver.compiled import by_type
from solver.kernels.resistance import Index, law_at
from solver.physics.resistance import (
    BinghamProfile,
    DryTurbulent,
    Hysteretic,
    Inertial,
    Quadratic,
    Uniform,
    Viscoplastic,
    Zoned,
)


@by_type
def law_of(law: Uniform, values: Array, i: Index) -> Uniform:
    """Make the law of a cell from a column of its parameters, (fields, cells)."""
    raise NotImplementedError


@law_at.of(DryTurbulent, Quadratic, BinghamProfile, Viscoplastic, Inertial, Hysteretic)
def _(law: Uniform, i: Index) -> Uniform:
    return law


@law_at.of(Zoned)
def _(law: Zoned, i: Index) -> Uniform:
    return law_of(law.law, law.values, i)


@law_of.of(DryTurbulent)
def _(law: DryTurbulent, values: Array, i: Index) -> DryTurbulent:
    return DryTurbulent(values[0, i], values[1, i])


@law_of.of(Quadratic)
def _(law: Quadratic, values: Array, i: Index) -> Quadratic:
    return Quadratic(values[0, i], values[1, i], values[2, i], values[3, i], values[4, i], values[5, i])


@law_of.of(BinghamProfile)
def _(law: BinghamProfile, values: Array, i: Index) -> BinghamProfile:
    return BinghamProfile(values[0, i], values[1, i])


@law_of.of(Viscoplastic)
def _(law: Viscoplastic, values: Array, i: Index) -> Viscoplastic:
    return Viscoplastic(values[0, i], values[1, i], values[2, i])


@law_of.of(Inertial)
def _(law: Inertial, values: Array, i: Index) -> Inertial:
    return Inertial(values[0, i], values[1, i], values[2, i], values[3, i], values[4, i])


@law_of.of(Hysteretic)
def _(law: Hysteretic, values: Array, i: Index) -> Hysteretic:
    return Hysteretic(
        values[0, i],
        values[1, i],
        values[2, i],
        values[3, i],
        values[4, i],
        values[5, i],
        values[6, i],
        values[7, i],
    )
