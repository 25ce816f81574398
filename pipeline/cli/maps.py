"""Commands that draw what a place holds: pictures, maps, the report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import pipeline
from pipeline.cli.exit_codes import SOME_FAILED, end, exit_on_errors
from pipeline.cli.options import Emulate, Out, Store, read_numbers, read_place
from pipeline.store.storage import Location

if TYPE_CHECKING:
    import pandas as pd

# tables that are shown
LISTED = ("leave-one-out", "emulated-receptors")
Thresholds = Annotated[
    str | None,
    typer.Option(metavar="NUMBERS", help="Thresholds as 0.5,1,2.", show_default="those of the scenario"),
]
RunShown = Annotated[
    int | None,
    typer.Option(min=0, help="Position of the run shown in motion.", show_default="that of median run-out"),
]


def plot(
    store: Store,
    run: Annotated[int, typer.Option(min=0, help="Position of the run in the store.")] = 0,
    times: Annotated[
        str | None,
        typer.Option(
            metavar="SECONDS",
            help="Times as 0,30,60; the nearest output times are drawn.",
            show_default="at most 12, evenly spread",
        ),
    ] = None,
    to: Annotated[
        Path | None,
        typer.Option(help="Picture to write.", show_default="STORE with .png for .zarr; of a URL, here"),
    ] = None,
) -> None:
    """Draw the depth of a run at its output times."""
    from pipeline.assess.plots import depth_panels
    from pipeline.cli.display import working
    from pipeline.store.storage import at_hand
    from pipeline.store.zarr_store import open_store

    path = to or at_hand(store.with_suffix(".png"))
    chosen = read_numbers("--times", times, zero=True)
    with exit_on_errors(reading=True), working("plot"), open_store(store) as opened:
        path.parent.mkdir(parents=True, exist_ok=True)
        depth_panels(opened, run, path, times=chosen)
    typer.echo(str(path))


def film(
    store: Store,
    run: RunShown = None,
    to: Annotated[
        Path | None,
        typer.Option(help="Film: .gif, .webp or .mp4 (by ffmpeg).", show_default="STORE with .gif for .zarr"),
    ] = None,
) -> None:
    """Write the film of a run, with scale, time and receptors."""
    from pipeline.cli.display import working
    from pipeline.report.film import write_film
    from pipeline.store.storage import at_hand
    from pipeline.store.zarr_store import open_store

    path = to or at_hand(store.with_suffix(".gif"))
    with exit_on_errors(reading=True), working("film"), open_store(store) as opened:
        write_film(opened, run, path)
    typer.echo(str(path))


def figures(
    out: Out,
    to: Annotated[
        Path | None, typer.Option(help="Folder to write to.", show_default="OUT/figures; of a URL, figures")
    ] = None,
) -> None:
    """Draw and table the runs of a place side by side, as the paper's figures 3 to 7 do."""
    from pipeline.cli.display import working
    from pipeline.report.comparison import draw
    from pipeline.store.storage import at_hand

    with exit_on_errors(reading=True), working("figures") as told:
        for path in draw(out, to or at_hand(out / "figures")):
            told.line(str(path))


def hazard(
    out: Out,
    to: Annotated[Path | None, typer.Option(help="Folder to write to.", show_default="OUT/hazard")] = None,
    depth: Thresholds = None,
    speed: Thresholds = None,
    momentum_flux: Thresholds = None,
    pressure: Thresholds = None,
    erosion_depth: Thresholds = None,
    spacing: Annotated[
        float | None, typer.Option(help="Of the lattice for clouds, m.", show_default="their mean spacing")
    ] = None,
    maps: Annotated[bool, typer.Option("--maps/--no-maps", help="Draw maps beside the NetCDF file.")] = True,
    emulate: Emulate = False,
) -> None:
    """Map the hazard of each scenario and of all together.

    Shares of runs that exceed thresholds (depth in m, speed in m/s, momentum flux in m3/s2, pressure in kPa,
    depth of erosion in m) with their bounds, quantiles, arrival, intensity and level of hazard, as NetCDF and
    PNG; with a georeference also as GeoTIFF, NetCDF and GeoPackage in its reference system.
    """
    from pipeline.cli.display import working
    from pipeline.store.storage import at_hand

    if spacing is not None and not spacing > 0:
        end(f"--spacing: expected a number above 0, found {spacing:g}")
    thresholds = {
        "depth": read_numbers("--depth", depth),
        "speed": read_numbers("--speed", speed),
        "momentum_flux": read_numbers("--momentum-flux", momentum_flux),
        "pressure": read_numbers("--pressure", pressure),
        "erosion_depth": read_numbers("--erosion-depth", erosion_depth),
    }
    with exit_on_errors(reading=True), working("hazard") as told:
        pipeline.hazard_maps(
            out,
            to=to or at_hand(out / "hazard"),
            **thresholds,
            spacing=spacing,
            pictures=maps,
            emulate=emulate,
            tell=told.line,
            warn=told.warning,
        )


def compare(
    out: Out,
    other: Annotated[
        Location | None,
        typer.Argument(parser=read_place, help="Place of the second scenario.", show_default="OUT"),
    ] = None,
    scenarios: Annotated[
        tuple[str, str],
        typer.Option(
            metavar="FIRST SECOND", help="Names of two scenarios; maps show the second less the first."
        ),
    ] = ...,  # type: ignore[assignment]
    to: Annotated[
        Path | None, typer.Option(help="Folder to write to.", show_default="OUT/compare/FIRST-SECOND")
    ] = None,
    depth: Thresholds = None,
    speed: Thresholds = None,
    momentum_flux: Thresholds = None,
    pressure: Thresholds = None,
    erosion_depth: Thresholds = None,
    spacing: Annotated[float | None, typer.Option(help="Of the lattice for clouds, m.")] = None,
    maps: Annotated[bool, typer.Option("--maps/--no-maps", help="Draw maps beside the NetCDF file.")] = True,
) -> None:
    """Map and table how two scenarios differ, as with a dam and without it.

    The difference of shares of runs, of depth, pressure and erosion on maps and at receptors, and of volume,
    peak discharge and arrival at sections, each with bounds that hold whatever runs are missing.
    """
    from pipeline.cli.display import working
    from pipeline.store.storage import at_hand

    if spacing is not None and not spacing > 0:
        end(f"--spacing: expected a number above 0, found {spacing:g}")
    with exit_on_errors(reading=True), working("compare") as told:
        pipeline.compare(
            out,
            scenarios,
            other,
            to=to or at_hand(out / "compare") / "-".join(scenarios),
            depth=read_numbers("--depth", depth),
            speed=read_numbers("--speed", speed),
            momentum_flux=read_numbers("--momentum-flux", momentum_flux),
            pressure=read_numbers("--pressure", pressure),
            erosion_depth=read_numbers("--erosion-depth", erosion_depth),
            spacing=spacing,
            pictures=maps,
            tell=told.line,
        )


def emulate(
    out: Out,
    name: Annotated[
        str | None,
        typer.Argument(metavar="NAME", help="One scenario.", show_default="all that are sampled"),
    ] = None,
    draws: Annotated[
        int, typer.Option(min=256, help="Draws of maps; single numbers take 4 times more.")
    ] = 4096,
    to: Annotated[Path | None, typer.Option(help="Folder to write to.", show_default="OUT/emulated")] = None,
    depth: Thresholds = None,
    speed: Thresholds = None,
    momentum_flux: Thresholds = None,
    pressure: Thresholds = None,
    maps: Annotated[bool, typer.Option("--maps/--no-maps", help="Draw maps beside the NetCDF file.")] = True,
) -> None:
    """Emulate sampled runs: maps, receptors and quantiles of many draws, with their errors.

    The table of leave-one-out comes first: it says what the runs support. What they do not is refused.
    """
    from pipeline.cli.display import working
    from pipeline.store import run_table
    from pipeline.store.storage import at_hand

    written: list[str] = []
    with exit_on_errors(reading=True), working("emulate") as told:
        found = pipeline.emulate(
            out,
            name,
            draws=draws,
            to=to or at_hand(out / "emulated"),
            depth=read_numbers("--depth", depth),
            speed=read_numbers("--speed", speed),
            momentum_flux=read_numbers("--momentum-flux", momentum_flux),
            pressure=read_numbers("--pressure", pressure),
            pictures=maps,
            tell=written.append,
            warn=told.warning,
        )
    for each in found.values():
        for title in LISTED:
            if title in each.tables:
                typer.echo(run_table.markdown(each.tables[title].drop(columns=_counted(each.tables[title]))))
    for line in written:
        typer.echo(line)
    if not found:
        raise typer.Exit(SOME_FAILED)


def _counted(table: pd.DataFrame) -> list[str]:
    """Name the columns that say how many runs are behind a number, which a line beside the table says too."""
    return [name for name in table.columns if str(name).startswith("runs_")]


def report(
    out: Out,
    to: Annotated[Path | None, typer.Option(help="Page to write.", show_default="OUT/report.html")] = None,
    run: RunShown = None,
    title: Annotated[
        str | None, typer.Option(help="Title.", show_default="that of the scenario, or the place")
    ] = None,
    author: Annotated[
        str | None, typer.Option(help="Who wrote it.", show_default="that of the scenario")
    ] = None,
    client: Annotated[str | None, typer.Option(help="For whom.", show_default="that of the scenario")] = None,
    date: Annotated[
        str | None, typer.Option(help="Day, as 2026-03-31.", show_default="that of the scenario")
    ] = None,
    emulate: Emulate = False,
    compare: Annotated[
        tuple[str, str] | None,
        typer.Option(metavar="FIRST SECOND", help="Two scenarios: how the second differs from the first."),
    ] = None,
    maps: Annotated[
        bool, typer.Option("--maps", help="Write the maps of `pipeline hazard` to OUT/hazard too.")
    ] = False,
) -> None:
    """Write one page about a place: findings, maps, runs to look at and to ask; it needs no network."""
    from pipeline.cli.display import working
    from pipeline.store.storage import at_hand

    with exit_on_errors(reading=True), working("report") as told:
        if maps:
            beside = at_hand(out / "hazard")
            pipeline.hazard_maps(out, to=beside, emulate=emulate, tell=told.line, warn=told.warning)
        head = {"title": title, "author": author, "client": client, "date": date}
        page = pipeline.write_report(out, to, run=run, emulate=emulate, compare=compare, **head)
    typer.echo(str(page))
