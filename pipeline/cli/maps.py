"""Commands that make maps of what a place holds; heavy imports stand inside them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pipeline.cli.options import BAD_INPUT, TROUBLE, Out, end, ending, read_numbers

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
    maps: Annotated[bool, typer.Option("--maps/--no-maps", help="Draw maps beside the NetCDF file.")] = True,
) -> None:
    """Map the hazard of each scenario and of all together.

    Shares of runs that exceed thresholds (depth in m, speed in m/s, momentum flux in m3/s2, pressure in kPa)
    with their bounds, quantiles, arrival, intensity and level of hazard, as NetCDF and PNG; with a
    georeference also as GeoTIFF, NetCDF and GeoPackage in its reference system.
    """
    from pipeline.assess.ensemble import NotTogetherError
    from pipeline.hazard.map_files import write_maps
    from pipeline.hazard.mapping import WHOLE, of_place, write
    from pipeline.store.storage import at_hand

    given = {"depth": depth, "speed": speed, "momentum_flux": momentum_flux, "pressure": pressure}
    read = {name: read_numbers(f"--{name.replace('_', '-')}", text) for name, text in given.items()}
    thresholds = {name: values for name, values in read.items() if values is not None}
    if spacing is not None and not spacing > 0:
        end(f"--spacing: expected a number above 0, found {spacing:g}")
    top = to or at_hand(out / "hazard")
    with ending({FileNotFoundError: BAD_INPUT, ValueError: BAD_INPUT, OSError: TROUBLE}):
        try:
            for name, found in of_place(out, thresholds, spacing):
                typer.echo(f"{name}: {found.attrs['comment']}")
                folder = top if name == WHOLE else top / name
                typer.echo(str(write(found, folder)))
                for path in write_maps(found, folder, _tell) if maps else ():
                    typer.echo(str(path))
        except NotTogetherError as error:
            typer.echo(f"no map over all scenarios: {error}", err=True)


def report(
    out: Out,
    to: Annotated[Path | None, typer.Option(help="Page to write.", show_default="OUT/report.html")] = None,
    run: Annotated[
        int | None,
        typer.Option(
            min=0, help="Position of the run shown in motion.", show_default="that of median run-out"
        ),
    ] = None,
) -> None:
    """Write one page about a place: maps, run-out, ledger, failures, versions; it needs no network."""
    from pipeline.report.page import report as write

    with ending({FileNotFoundError: BAD_INPUT, ValueError: BAD_INPUT, OSError: TROUBLE}):
        typer.echo(str(write(out, to or out / "report.html", run)))


def _tell(line: str) -> None:
    typer.echo(line, err=True)
