"""Schemes: the form of the method, and its numerical choices."""

from __future__ import annotations

from typing import ClassVar, Literal

from solver.parameters import Checked, Parameter, parameter, parametric, shared

DerivativeName = Literal["full", "diffuse"]

CFL = Parameter(
    meaning="Courant number of the time step",
    above=0,
    scenario_at_most=1,
    advice="Leave it; a smaller number takes more time steps.",
)
WET_LIMIT = Parameter(
    meaning="depth up to which a cell counts as dry and moves beside a flow alone, as part of the largest "
    "depth that is released, held at a side or comes in",
    above=0,
    below=1,
)
REST_SHARE = Parameter(
    meaning="share of the volume released and to come in that may still move in a run that counts as at rest",
    at_least=0,
    below=1,
)
DEGREE = Parameter(meaning="degree of the LMLS basis", choices={1: "linear", 2: "quadratic"})
WEIGHT_SHAPE = Parameter(meaning="shape parameter c of the LMLS weight (eq. 18)", above=0)


@parametric
class WeightedResidual(Checked):
    """The conservative form.

    Its Courant condition is that of the unsplit step, ``dt max((|u| + c_x)/dx + (|v| + c_y)/dy) <= cfl``.
    A lattice takes slopes from its own four neighbours.

    Raises
    ------
    ParameterError
        If a choice is out of its range.
    """

    advice: ClassVar[str] = "all assessments: it conserves volume and comes to exact rest"

    cfl: float = shared(CFL, default=0.9)
    wet_limit: float = shared(WET_LIMIT, default=1e-4)
    rest_share: float = shared(REST_SHARE, default=1e-4)
    support: int = parameter(
        "cells that a slope is taken from, clouds only", default=9, at_least=3, at_most=100
    )
    degree: int = shared(DEGREE, meaning="degree of the LMLS basis, clouds only", default=1)
    weight_shape: float = shared(
        WEIGHT_SHAPE, meaning="shape parameter c of the LMLS weight (eq. 18), clouds only", default=6.0
    )


@parametric
class Collocation(Checked):
    """The paper's own form, on a lattice or a cloud; a part is one of the largest initial depth.

    Its Courant condition is ``dt max((|u| + c_x) sum |D_x| + (|v| + c_y) sum |D_y|) <= cfl``, D the
    derivative weights.

    Raises
    ------
    ParameterError
        If a choice is out of its range or unknown.
    """

    advice: ClassVar[str] = "studies of the paper's method; it does not conserve volume exactly"

    support: int = parameter("points of a support", default=49, at_least=6, at_most=200)
    degree: int = shared(DEGREE, default=2)
    weight_shape: float = shared(WEIGHT_SHAPE, default=9.0)
    derivative: DerivativeName = parameter(
        "derivative of the approximation",
        default="full",
        choices={
            "full": "of shape functions and coefficients (MLS)",
            "diffuse": "as eq. 23 is printed (WLS)",
        },
    )
    relaxation: float = parameter("omega of eq. 25; 0 relaxes nothing", default=0.5, at_least=0, at_most=1)
    threshold: float = parameter("threshold of eq. 24", default=0.02, at_least=0)
    floor: float = parameter("least depth that eq. 24 divides by, as a part", default=1e-3, at_least=0)
    smoothing: Literal["pairs", "printed"] = parameter(
        "how values are smoothed",
        default="pairs",
        choices={
            "pairs": "exchange between pairs of points, which makes no volume",
            "printed": "replace by eq. 25, to the letter with a relaxation of 1",
        },
    )
    smoothed: Literal["all", "depth"] = parameter(
        "what is smoothed", default="all", choices={"all": "h, hu and hv", "depth": "h alone"}
    )
    clip: bool = parameter("whether negative depths are set to zero, which makes volume", default=False)
    film: float = parameter(
        "depth below which a point takes the mean velocity of the flow around it, as a part",
        default=5e-3,
        at_least=0,
    )
    cfl: float = shared(CFL, default=0.7)
    wet_limit: float = shared(
        WET_LIMIT,
        meaning="depth up to which a point counts as dry and does not move, as a part",
        default=1e-4,
    )
    rest_share: float = shared(REST_SHARE, default=1e-4)


Scheme = WeightedResidual | Collocation

SCHEMES = (WeightedResidual, Collocation)
"""All forms; the first is the default."""
