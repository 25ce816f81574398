"""Scenarios: what YAML files say, checked, with the text they were read from."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from pydantic import TypeAdapter

from pipeline.inputs.elevation_table import ElevationTable
from pipeline.inputs.ground import Ground
from pipeline.inputs.hydrograph_table import HydrographTable
from pipeline.inputs.point_file import PointFile
from pipeline.mistakes import BadInput, Mistake
from pipeline.scenario import checks
from pipeline.scenario.design import ChosenRuns, draw
from pipeline.scenario.levels import split
from pipeline.scenario.places import part_inside
from pipeline.scenario.schema_errors import check
from pipeline.scenario.strict_yaml import Document, parse
from pipeline.settings.points import GradedPoints
from pipeline.settings.receptor import Receptor, source_of
from pipeline.settings.settings import OF_ALL_RUNS, Domain, Settings, json_schema

# What says nothing of a run's values: words, limits of its cost, and what its values are used for.
IRRELEVANT: Any = {
    **dict.fromkeys(("description", *OF_ALL_RUNS - {"sweep", "sample"}), True),
    "time": {"max_steps", "max_wall"},
}

# keys that are no part of a scenario without them, whose content is that of before there were any
WHERE_USED = {"release", "inflow", "sections", "structures"}

# attribute of a store with the receptors that the scenario gives on the map or in a file, in x and y
ON_BED = "receptors_on_bed"
# attribute of a store whose domain was found, by some runs that were cut off, overrun or failed: how many
UNSETTLED = "domain_unsettled_runs"
RECEPTORS = TypeAdapter(tuple[Receptor, ...])

__all__ = ["BadInput", "Mistake", "Scenario", "Settings", "json_schema", "load"]


@dataclass(frozen=True)
class Scenario:
    """One file of the catalogue.

    Parameters
    ----------
    settings : Settings
        The file's content with defaults filled in, before any sweep; releases and receptors in
        coordinates of the bed, whatever the file gives them in.
    path, text : Path
        The file and what stands in it.
    data : mapping of str to Any
        What stands in it, as plain data; lists are tuples, and releases are on the bed.
    content : str
        Canonical JSON of everything that decides the result (tables and draws by digest; left out is what
        ``IRRELEVANT`` lists).
    digest : str
        SHA-256 of ``content``, hexadecimal.
    tables : mapping of str to ElevationTable
        Elevation tables by the name the settings give them.
    points : PointFile, optional
        What a file of points holds.
    ground : Ground, optional
        Elevation models and polygons of a scenario on them; those near its releases as long as it has no
        domain.
    hydrographs : mapping of str to HydrographTable
        Those of files, by the name the settings give them.
    chosen : ChosenRuns, optional
        The runs, in place of those of the design, of a scenario of chosen runs.
    unsettled : int
        Runs that were cut off, overrun or failed among those that found its domain, which then is no proof of
        where no flow comes.
    warnings : tuple of str
        One line each, to be shown and not to be stopped by.
    """

    settings: Settings
    path: Path
    text: str
    data: Mapping[str, Any]
    content: str
    digest: str
    tables: Mapping[str, ElevationTable]
    points: PointFile | None = None
    warnings: tuple[str, ...] = ()
    ground: Ground | None = None
    hydrographs: Mapping[str, HydrographTable] = field(default_factory=dict)
    chosen: ChosenRuns | None = None
    unsettled: int = 0

    @property
    def name(self) -> str:
        """Name of the scenario, which is that of its store."""
        return self.settings.name

    def within(self, domain: Domain, unsettled: int = 0) -> Scenario:
        """Give the scenario with a domain that was found.

        Of places from a file those outside are left out, as no flow comes there. Where some runs that found
        it were ``unsettled`` that is not known, and all places stay. What decides its results is the part of
        the elevation model around the domain.

        Raises
        ------
        ElevationRasterError
            If an elevation model is no longer what it was, or holds nothing there.
        """
        settings = self.settings.model_copy(update={"domain": domain})
        if self.ground is None:
            return replace(self, settings=settings, unsettled=unsettled)
        if source_of(self.data.get("receptors")) is not None and not unsettled:
            inside = tuple(each for each in settings.places if part_inside(each, domain) > 0)
            settings = settings.model_copy(update={"receptors": inside})
        ground = self.ground.within(domain)
        content = json.dumps({**json.loads(self.content), "map_files": ground.digests})
        digest = hashlib.sha256(content.encode()).hexdigest()
        return replace(
            self, settings=settings, ground=ground, content=content, digest=digest, unsettled=unsettled
        )


def load(sources: Iterable[str | Path | Mapping[str, Any]]) -> list[Scenario]:
    """Read and check scenarios, in the order given; one with levels comes as one scenario a spacing.

    Parameters
    ----------
    sources : iterable of path or mapping
        Files, or the content of one; what a mapping names is looked for in the working directory.

    Raises
    ------
    BadInput
        With every mistake of every file, if there is one.
    """
    mistakes: list[Mistake] = []
    scenarios: list[Scenario] = []
    names: dict[str, str] = {}
    for number, source in enumerate(sources):
        if isinstance(source, Mapping):
            name = source.get("name")
            path = Path(name if isinstance(name, str) else f"scenario {number}")
        else:
            path = Path(source)
        text = written(source) if isinstance(source, Mapping) else _read(path, mistakes)
        if text is None:
            continue
        document = replace(parse(text, str(path)), no_file=isinstance(source, Mapping))
        name = document.data.get("name")
        if isinstance(name, str) and name in names:
            found = f"expected a name of its own, found '{name}' of {names[name]} again"
            mistakes.append(document.mistake(("name",), found))
        elif isinstance(name, str):
            names[name] = str(path)
        folder = Path() if document.no_file else path.parent
        for part, checked in split(document, checks.check_document(document, folder), folder):
            wrong = [*part.mistakes, *checked.mistakes]
            if checked.settings is None and not wrong:
                # no file is passed over in silence, whatever its checks overlook
                wrong = [part.mistake((), "expected a scenario, found one whose mistake has no name")]
            mistakes += wrong
            if checked.settings is not None:
                scenarios.append(_scenario(part, checked, path, text))
    if mistakes:
        raise BadInput(mistakes)
    return scenarios


def _scenario(document: Document, checked: checks.Checked, path: Path, text: str) -> Scenario:
    assert checked.settings is not None
    content = _content(checked)
    return Scenario(
        checked.settings,
        path,
        text,
        _placed(document.data, checked.settings),
        content,
        hashlib.sha256(content.encode()).hexdigest(),
        checked.tables,
        checked.points,
        checked.warnings,
        checked.ground,
        checked.hydrographs,
    )


def stored(attributes: Mapping[str, Any]) -> Settings:
    """Read the settings that a store was made from, out of its attributes.

    Raises
    ------
    ValueError
        If this version does not know what stands there.
    """
    found = check(parse(str(attributes["scenario"]), str(attributes["title"])).data)
    if isinstance(found, list):
        raise ValueError(f"the scenario of {attributes['title']} is not known here: {found[0].message}")
    receptors = attributes.get(ON_BED)
    on_bed = found.georeference is None or found.georeference.receptors == "bed"
    if receptors is None or (on_bed and isinstance(found.receptors, tuple)):
        return found
    return found.model_copy(update={"receptors": RECEPTORS.validate_json(str(receptors))})


def _placed(data: dict[str, Any], settings: Settings) -> dict[str, Any]:
    """Give the data of a file with its releases on the bed, and points where its receptors are."""
    points = settings.points
    if isinstance(points, GradedPoints) and any(each.get("receptor") for each in data["points"]["refine"]):
        refine = tuple(each.model_dump(exclude_unset=True) for each in points.refine)
        data = {**data, "points": {**data["points"], "refine": refine}}
    ground = settings.georeference
    if ground is None or ground.releases != "map" or not settings.releases:
        return data
    releases = [release.model_dump(exclude_unset=True) for release in settings.releases]
    return {**data, "release": tuple(releases) if isinstance(settings.release, tuple) else releases[0]}


def said(scenario: Scenario) -> dict[str, str]:
    """Attributes with the words of a scenario, which may change without its runs changing."""
    words = {"comment": scenario.settings.description, "scenario": scenario.text}
    ground = scenario.settings.georeference
    from_file = source_of(scenario.data.get("receptors")) is not None
    if (ground is None or ground.receptors == "bed") and not from_file:
        return words
    return {**words, ON_BED: RECEPTORS.dump_json(scenario.settings.places).decode()}


def written(content: Mapping[str, Any]) -> str:
    """Write the content of a scenario as YAML; NumPy's numbers and arrays, and paths, become plain ones."""
    return yaml.safe_dump(_plain(content), sort_keys=False, allow_unicode=True, default_flow_style=None)


def _plain(value: Any) -> Any:
    match value:
        case Mapping():
            return {str(name): _plain(inner) for name, inner in value.items()}
        case list() | tuple():
            return [_plain(inner) for inner in value]
        case np.ndarray() | np.generic():
            return value.tolist()
        case Path():
            return str(value)
        case _:
            return value


def _read(path: Path, mistakes: list[Mistake]) -> str | None:
    """Read a text file, or note why it cannot be read."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        mistakes.append(Mistake(str(path), 1, 1, "", f"expected a readable file, found {error.strerror}"))
    except UnicodeDecodeError as error:
        before = error.object[: error.start]
        line, column = before.count(b"\n") + 1, error.start - before.rfind(b"\n")
        found = f"expected UTF-8 text, found the byte 0x{error.object[error.start]:02x}"
        mistakes.append(Mistake(str(path), line, column, "", found))
    return None


def _content(checked: checks.Checked) -> str:
    """Give the canonical JSON of settings and files; keys stay in order, as that of the sweep matters."""
    assert checked.settings is not None
    held = checked.settings.model_dump(mode="json", exclude=IRRELEVANT)
    if held.get("sample"):
        # each is a scenario of its own
        held["sample"].pop("levels")
    # what a scenario has nothing of makes no difference to it, and stores of before stay valid
    held = {name: value for name, value in held.items() if value or name not in WHERE_USED}
    for refine in held["points"].get("refine", ()):
        # what it stands for is there
        refine.pop("receptor")
    for release in held["release"] if isinstance(held.get("release"), list) else [held.get("release")]:
        if release and not release.get("each", True):
            release.pop("each")
    tables = {name: table.digest for name, table in sorted(checked.tables.items())}
    files = {} if checked.points is None else {"file": checked.points.digest}
    whole = {**held, "points": {**held["points"], **files}, "tables": tables}
    if checked.ground is not None:
        whole["map_files"] = checked.ground.digests
    if checked.hydrographs:
        whole["hydrographs"] = {name: table.digest for name, table in sorted(checked.hydrographs.items())}
    if checked.settings.sample is not None:
        # another version of SciPy may draw otherwise
        drawn = json.dumps(draw(checked.settings.sample))
        whole["draws"] = hashlib.sha256(drawn.encode()).hexdigest()
    return json.dumps(whole)
