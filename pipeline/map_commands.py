"""Commands that make maps of what a place holds; heavy imports stand inside them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pipeline.options import BAD_INPUT, TROUBLE, Out, end, ending, read_numbers

Thresholds = Annotated[
    str | None,
    typer.Option(metavar="NUMBERS", help="Thresholds as 0.5,1,2.", show_default="those of the scenario"),
]


def hazard(
    out: Out,
    to: Annotated[Path | None, typer.Option(help="Folder to write to.", show_default="OUT/hazard")] = None,
    depth: Thresholds = None,
    speed: Thresholds = None,
    momentum_flux: Thresholds = None,
    pressure: Thresholds = None,
    spacing: Annotated[
        float | None, typer.Option(help="Of the lattice for clouds, m.", show_default="their mean spacing")
    ] = None,
) -> None:
    """Map the hazard of each scenario and of all together.

    Shares of runs that exceed thresholds (depth in m, speed in m/s, momentum flux in m3/s2, pressure in kPa)
    with their bounds, quantiles, arrival, intensity and level of hazard, as NetCDF.
    """
    from pipeline.ensemble import NotTogetherError
    from pipeline.hazard import WHOLE, of_place, write

    given = {"depth": depth, "speed": speed, "momentum_flux": momentum_flux, "pressure": pressure}
    read = {name: read_numbers(f"--{name.replace('_', '-')}", text) for name, text in given.items()}
    thresholds = {name: values for name, values in read.items() if values is not None}
    if spacing is not None and not spacing > 0:
        end(f"--spacing: expected a number above 0, found {spacing:g}")
    top = to or out / "hazard"
    with ending({FileNotFoundError: BAD_INPUT, ValueError: BAD_INPUT, OSError: TROUBLE}):
        try:
            for name, found in of_place(out, thresholds, spacing):
                typer.echo(f"{name}: {found.attrs['comment']}")
                typer.echo(str(write(found, top if name == WHOLE else top / name)))
        except NotTogetherError as error:
            typer.echo(f"no map over all scenarios: {error}", err=True)
