"""Score runs by an observed deposit."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.api.options import Tell, silent, warn_user
from pipeline.api.places import find_store
from pipeline.errors import OptionError

if TYPE_CHECKING:
    import pandas as pd

    from pipeline.api.places import Anywhere

POSTERIOR_DRAWS = 2**16


def calibrate(
    store: Anywhere,
    observed: str | PathLike[str],
    *,
    threshold: float | None = None,
    accepted: float = 0.1,
    emulate: bool = False,
    outline_error: float | None = None,
    to: str | PathLike[str] | None = None,
    tell: Tell = silent,
    warn: Tell = warn_user,
) -> dict[str, pd.DataFrame]:
    """Score the runs of a scenario by an observed deposit, and give the ranges of their parameters.

    Parameters
    ----------
    store : path or str
        Store of the scenario.
    observed : path
        Outline (CSV of x, y; GeoPackage, GeoJSON, Shapefile) or depths (CSV, NetCDF, GeoTIFF).
    threshold : float, optional
        Depth of a deposit, m; by default the scenario's ``output.threshold``.
    accepted : float
        Share of the runs that is accepted.
    emulate : bool
        Whether to give the posterior of sampled parameters over many emulated draws too.
    outline_error : float, optional
        Standard deviation of where the observed outline lies, m, for the posterior; by default the spacing.
    to : path, optional
        Folder that the tables are written to, as CSV and Markdown; by default nothing is written.
    tell, warn : callable
        Told the path of each file, and why there is no posterior.

    Returns
    -------
    dict of str to DataFrame
        ``scores``, a row per run, the best first; ``parameters``, ranges over all and over accepted runs;
        ``posterior``, where it is asked for and the runs support it.

    Raises
    ------
    FileNotFoundError
        If there is no store.
    ObservationError
        If the observation cannot be compared with the runs.
    OptionError
        If no threshold is given, by the scenario neither, or an error of the outline without ``emulate``.
    """
    if outline_error is not None and not emulate:
        raise OptionError("outline_error", "expected with --emulate, whose posterior it is for")
    from pipeline.assess.calibration import posterior, score
    from pipeline.assess.observed import read
    from pipeline.assess.tables import write
    from pipeline.scenario.scenario import stored
    from pipeline.store.zarr_store import open_store

    with open_store(find_store(store)) as opened:
        least = threshold if threshold is not None else stored(opened.attrs).output.threshold
        if least is None:
            raise OptionError("threshold", "expected a depth, as the scenario gives no output.threshold")
        deposit = read(Path(observed), opened, least)
        scores = score(opened, deposit, least)
        made = {"scores": scores, "parameters": posterior(opened, scores, accepted)}
        if emulate:
            from pipeline.emulation.calibrated import posterior_table
            from pipeline.emulation.errors import NotEmulatedError
            from pipeline.emulation.sampled import sampled

            try:
                with sampled(find_store(store)) as runs:
                    found = posterior_table(runs, deposit, least, outline_error, POSTERIOR_DRAWS)
                made["posterior"] = found
            except NotEmulatedError as error:
                warn(f"no posterior: {error}")
    if to is not None:
        for path in write(made, Path(to), ["csv", "md"]):
            tell(str(path))
    return made
