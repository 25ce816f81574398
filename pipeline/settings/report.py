"""Section of a scenario that says what stands at the head of its report; no run depends on it."""

from __future__ import annotations

from datetime import date

from pydantic import model_validator

from pipeline.mistakes import describe
from pipeline.settings.section import Section, key, relation

LONGEST = 300


class Report(Section):
    """What stands at the head of the page of `pipeline report`."""

    title: str | None = key("title. Default: the name of the place", default=None, max_length=LONGEST)
    author: str | None = key("who wrote it", default=None, max_length=LONGEST)
    client: str | None = key("for whom", default=None, max_length=LONGEST)
    date: str | None = key("day of the report, as 2026-03-31", default=None)
    remarks: str | None = key("what else is to be said, in a paragraph", default=None)

    @model_validator(mode="after")
    def _dated(self) -> Report:
        if self.date is not None and not is_date(self.date):
            raise relation(f"expected a day as 2026-03-31, found {describe(self.date)}", "date")
        return self


def is_date(text: str) -> bool:
    """Whether a text is a day of the calendar, as 2026-03-31."""
    try:
        return date.fromisoformat(text).isoformat() == text
    except ValueError:
        return False
