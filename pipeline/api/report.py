"""Write the report of a place."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pipeline.api.places import place_of, writable
from pipeline.errors import OptionError

if TYPE_CHECKING:
    from pipeline.api.places import Anywhere, Place
    from pipeline.store.storage import Location


def write_report(
    out: Place,
    to: Anywhere | None = None,
    *,
    run: int | None = None,
    title: str | None = None,
    author: str | None = None,
    client: str | None = None,
    date: str | None = None,
    emulate: bool = False,
    compare: tuple[str, str] | None = None,
) -> Location:
    """Write one page about a place, whole in itself: findings, maps, runs to look at and to ask, inputs.

    Parameters
    ----------
    out : path, str or Results
        The place.
    to : path, optional
        The page; by default ``report.html`` in the place.
    run : int, optional
        Position of the run shown in motion; by default that of median run-out.
    title, author, client, date : str, optional
        Head of the page, in place of what the scenarios say under ``report``; a date is as 2026-03-31.
    emulate : bool
        Whether to add emulated maps and tables, see `emulate`.
    compare : tuple of str, optional
        Names of two scenarios of the place: a chapter says how the second differs from the first.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    FileNotFoundError
        If the place holds no store.
    ValueError
        If no scenario has such a run, or the two scenarios cannot be compared.
    OptionError
        If the date is none.
    OSError
        If the page cannot be written.
    """
    from pipeline.report.page import write_report as write
    from pipeline.settings.report import Report, is_date

    if date is not None and not is_date(date):
        raise OptionError("date", f"expected a day as 2026-03-31, found '{date}'")
    place = place_of(out)
    head = Report(title=title, author=author, client=client, date=date)
    return write(place, place / "report.html" if to is None else writable(to), run, head, emulate, compare)
