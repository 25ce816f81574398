"""Settings of the scheme: the form of the method and its numerical choices."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from pipeline.settings.section import Positive, Section, key


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
    weight_shape: Positive = key("shape parameter c of the LMLS weight (eq. 18), clouds only", default=6.0)


class Collocation(Section):
    """The paper's own form; a part is one of the largest initial depth."""

    form: Literal["collocation"] = key("the paper's own form, on the points of a lattice or a cloud")
    support: Annotated[int, Field(ge=6, le=200)] = key("points of a support", default=49)
    degree: Literal[1, 2] = key("degree of the LMLS basis", default=2)
    weight_shape: Positive = key("shape parameter c of the LMLS weight (eq. 18)", default=9.0)
    derivative: Literal["full", "diffuse"] = key(
        "derivative of the approximation: `full` (MLS), or `diffuse` as eq. 23 is printed (WLS)",
        default="full",
    )
    relaxation: Annotated[float, Field(ge=0, le=1)] = key("omega of eq. 25; 0 relaxes nothing", default=0.5)
    threshold: Annotated[float, Field(ge=0)] = key("threshold of eq. 24", default=0.02)
    floor: Annotated[float, Field(ge=0)] = key("least depth that eq. 24 divides by, as a part", default=1e-3)
    smoothing: Literal["pairs", "printed"] = key(
        "`pairs` exchanges between pairs of points and makes no volume; `printed` replaces by eq. 25, "
        "to the letter with a relaxation of 1",
        default="pairs",
    )
    smoothed: Literal["all", "depth"] = key(
        "what is smoothed: `all` of h, hu and hv, or `depth`", default="all"
    )
    clip: bool = key("whether negative depths are set to zero, which makes volume", default=False)
    film: Annotated[float, Field(ge=0)] = key(
        "depth below which a point takes the mean velocity of the flow around it, as a part", default=5e-3
    )
    cfl: Annotated[float, Field(gt=0, le=1)] = key("Courant number of the time step", default=0.7)
    wet_limit: Annotated[float, Field(gt=0, lt=1)] = key(
        "depth up to which a point counts as dry and does not move, as a part", default=1e-4
    )
    rest_share: Annotated[float, Field(ge=0, lt=1)] = key(
        "share of the released volume that may still move in a run that counts as at rest", default=1e-4
    )


def _form(value: Any) -> Any:
    default = "weighted-residual"
    return value.get("form", default) if isinstance(value, Mapping) else getattr(value, "form", default)


Scheme = Annotated[
    Annotated[WeightedResidual, Tag("weighted-residual")] | Annotated[Collocation, Tag("collocation")],
    Discriminator(
        _form,
        custom_error_type="union_tag_invalid",
        custom_error_context={"discriminator": "'form'", "tag": "", "expected_tags": ""},
    ),
]
