"""Settings of the scheme: the form of the method and its numerical choices."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from pipeline.section import Positive, Section, key


class WeightedResidual(Section):
    """The conservative form."""

    form: Literal["weighted-residual"] = key("the conservative form", default="weighted-residual")
    cfl: Annotated[float, Field(gt=0, le=1)] = key("Courant number of the time step", default=0.9)
    wet_limit: Annotated[float, Field(gt=0, lt=1)] = key(
        "depth up to which a cell counts as dry and does not move, as part of the largest initial depth",
        default=1e-4,
    )
    rest_share: Annotated[float, Field(ge=0, lt=1)] = key(
        "share of the released volume that may still move in a run that counts as at rest", default=1e-4
    )
    support: Annotated[int, Field(ge=3, le=100)] = key(
        "cells that a slope is taken from, clouds only", default=9
    )
    degree: Literal[1, 2] = key("degree of the LMLS basis, clouds only", default=1)
    weight_shape: Positive = key("shape parameter c of the LMLS weight (eq. 18), clouds only", default=4.0)


Scheme = WeightedResidual
