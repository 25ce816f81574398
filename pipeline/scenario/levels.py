"""Scenarios with levels: one scenario a spacing, which share draws, name and file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pipeline.scenario import checks
from pipeline.scenario.checks import Checked
from pipeline.scenario.strict_yaml import Document
from pipeline.settings.sample import Sample
from pipeline.store.place import LEVEL


def at_level(sample: Sample, count: int) -> Sample:
    """Give the sample of one level: the first draws of the whole."""
    return sample.model_copy(update={"count": count, "levels": ()})


def split(document: Document, checked: Checked, folder: Path) -> list[tuple[Document, Checked]]:
    """Give what a file asks for level by level, the coarsest first, each checked on its own spacing.

    The coarsest has the name of the scenario; finer ones, ``valley/4m``, lie within its store. A file without
    levels, or with mistakes, comes back as it is.

    Parameters
    ----------
    document : Document
        The file.
    checked : Checked
        What came of checking it.
    folder : Path
        That names of files are relative to.
    """
    settings = checked.settings
    if settings is None or settings.sample is None or not settings.sample.levels:
        return [(document, checked)]
    found: list[tuple[Document, Checked]] = []
    # levels are judged together, by the keys that the file has
    of_levels = [line for line in checked.warnings if ": sample.levels." in line]
    for level in settings.sample.levels:
        sample = {key: value for key, value in document.data["sample"].items() if key != "levels"}
        changed = {
            "points": {**document.data["points"], "spacing": level.spacing},
            "sample": {**sample, "count": level.count},
        }
        part = replace(document, data={**document.data, **changed})
        one = checks.check_document(part, folder)
        if one.settings is None:
            return [(part, one)]
        name = f"{settings.name}{LEVEL}{level.name}" if found else settings.name
        told = {line for _, before in found for line in before.warnings}
        own = [line for line in one.warnings if line not in told and ": sample.count: " not in line]
        warnings = tuple(own if found else [*of_levels, *own])
        found.append(
            (part, replace(one, settings=one.settings.model_copy(update={"name": name}), warnings=warnings))
        )
    return found
