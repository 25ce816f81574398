"""What a design must be: lists and draws for keys that exist, and every run of it a scenario that holds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from pipeline.hints import meant
from pipeline.mistakes import Problem, describe
from pipeline.scenario import schema_errors
from pipeline.scenario.design import Design, design, draw
from pipeline.scenario.solver_objects import Outlines, chosen, with_attributes
from pipeline.scenario.strict_yaml import Path
from pipeline.scenario.sweep import SWEEPABLE, Value, assign, named, path_of
from pipeline.settings.sample import MOST_RUNS, Sample
from pipeline.settings.settings import OF_ALL_RUNS, Settings
from pipeline.settings.surface import PolygonsRelease

Check = Callable[[Mapping[str, Any]], list[Problem]]


def check_design(
    document: Mapping[str, Any], sample: Sample | None, problems: list[Problem], check: Check
) -> list[Problem]:
    """List what is wrong with the sweep and the sample of a file that has ``problems`` beside them.

    ``sample`` is that of the file's settings, where these keep to the schema.

    Values are tried one by one first. Only where the scenario holds and some values of each list are left
    are they tried together, and what is wrong then is put to the entry of the list that brought it in, or
    once to the distribution that did.
    """
    data = {name: value for name, value in document.items() if name not in OF_ALL_RUNS}
    sweep = document.get("sweep", {})
    found: list[Problem] = []
    lists: dict[Path, dict[Value, Path]] = {}
    malformed = {problem.path[1] for problem in problems if problem.path[0] == "sweep" and problem.path[1:]}
    for key, values in sweep.items() if isinstance(sweep, dict) else ():
        if key in malformed or not isinstance(values, tuple) or not values:
            continue
        if any(_holds(problem.path, key) for problem in problems):
            continue
        path, unknown = _known(("sweep", key), key, data, values[0])
        if path is None or path in lists:
            again = Problem(("sweep", key), f"expected each key once, found '{key}' again", at_key=True)
            found.append(unknown or again)
            continue
        found += _same_kind(key, values)
        lists[path] = {}
        for i, value in enumerate(values):
            entry: Path = ("sweep", key, i)
            own = [
                problem
                for problem in _schema_problems(assign(data, path, value))
                if problem.path[: len(path)] == path and not problem.related
            ]
            if value in lists[path]:
                own.append(Problem(entry, f"expected each value once, found {describe(value)} again"))
            found += [Problem(entry, problem.message) for problem in own]
            if not own:
                lists[path][value] = entry
    if problems or not all(lists.values()):
        return found
    swept = {str(path): tuple(values) for path, values in lists.items()}
    draws = {} if sample is None else draw(sample)
    for key, column in draws.items():
        place: Path = ("sample", "values", key)
        path, unknown = _known(place, key, data, column[0])
        if path is None:
            found += [unknown] if unknown else []
        elif path in lists:
            found.append(Problem(place, f"expected a key that is not swept, found '{key}'", at_key=True))
        else:
            lists[path] = dict.fromkeys(column, place)
    runs = Design(swept, draws)
    if len(runs) > MOST_RUNS:
        place = ("sample", "count") if draws else ("sweep",)
        found.append(Problem(place, f"expected at most {MOST_RUNS:,} runs, found {len(runs):,}"))
    if len(lists) < len(runs.keys) or len(runs) > MOST_RUNS:
        return found
    return [*found, *_together(data, lists, runs, check)]


def _together(
    data: Mapping[str, Any], lists: Mapping[Path, Mapping[Value, Path]], runs: Design, check: Check
) -> list[Problem]:
    """List what is wrong with the runs of a design.

    Of an entry of a list it is the first thing at each key, of a distribution the first thing alone: other
    runs with the same entry would say it again with other numbers.
    """
    found: dict[tuple[Path, ...], Problem] = {}
    for i in range(len(runs)):
        changed, values = data, runs[i]
        for path, value in zip(lists, values, strict=True):
            changed = assign(changed, path, value)
        for problem in check(changed):
            place = _blame(problem, values, lists)
            drawn = place[0] == "sample"
            message = f"{problem.message} in run {i}" if drawn else problem.message
            found.setdefault((place,) if drawn else (place, problem.path), Problem(place, message))
    return list(found.values())


def _known(
    place: Path, key: str, data: Mapping[str, Any], value: Value
) -> tuple[Path, None] | tuple[None, Problem]:
    """Give the path of a varied key, or what is wrong with it."""
    path = path_of(key, data)
    problems = [] if path is None else _schema_problems(assign(data, path, value))
    if path is not None and not _is_unknown(path, problems):
        return path, None
    hint = next((problem.hint for problem in problems if problem.at_key), "") or _hint(key, data)
    expected = f"expected a key of the scenario below {', '.join(SWEEPABLE)}, found '{key}'{hint}"
    return None, Problem(place, expected, at_key=True)


def _hint(key: str, data: Mapping[str, Any]) -> str:
    """Say which key may be meant by one that leads nowhere."""
    first, _, rest = key.partition(".")
    if first == "release" and isinstance(data.get(first), tuple):
        several = named(rest.split("."), data[first])
        if len(several) > 1:
            wanted = " or ".join(f"{first}.{i}.{rest}" for i in several)
            return f", which may be of {len(several)} releases. Write {wanted}"
    if first in ("release", "inflow") and rest and isinstance(data.get(first), tuple):
        return "" if rest[0].isdigit() else f". Did you mean '{first}.0.{rest}'?"
    places = schema_errors.keys_elsewhere().items()
    varied = {name: place for name, place in places if place.partition(".")[0] in SWEEPABLE}
    return "" if first in SWEEPABLE else meant(first, SWEEPABLE, varied)


def _schema_problems(data: Mapping[str, Any]) -> list[Problem]:
    checked = schema_errors.check(data)
    return checked if isinstance(checked, list) else []


def _holds(path: Path, key: str) -> bool:
    """Whether a dotted key leads through a path, whose being wrong says nothing of the key."""
    parts = key.split(".")
    return len(path) < len(parts) and [str(part) for part in path] == parts[: len(path)]


def _is_unknown(path: Path, problems: list[Problem]) -> bool:
    """Whether the schema has no key of this path."""
    return any(
        path[: len(problem.path)] == problem.path and (problem.at_key or problem.path != path)
        for problem in problems
        if not problem.related
    )


def _same_kind(key: str, values: tuple[Value, ...]) -> list[Problem]:
    """Refuse lists of numbers and words, which make no coordinate."""
    kinds = {float if type(value) is int else type(value) for value in values}
    if len(kinds) == 1:
        return []
    return [Problem(("sweep", key), "expected values of one kind, found several")]


def _blame(problem: Problem, values: tuple[Value, ...], lists: Mapping[Path, Mapping[Value, Path]]) -> Path:
    """Find the entry of a sweep's list that brought in a problem the scenario itself has not."""
    wanted = problem.related or (problem.path,)
    paths = list(lists)

    def distance(path: Path) -> tuple[int, int]:
        common = {rank: _common(path, other) for rank, other in enumerate(wanted)}
        nested = [rank for rank, n in common.items() if n in (len(path), len(wanted[rank]))]
        return (min(nested, default=len(wanted)), -max(common.values()))

    path = min(paths, key=distance)
    return lists[path][values[paths.index(path)]]


def _common(path: Path, other: Path) -> int:
    """Count the leading parts that two paths share."""
    count = 0
    for mine, theirs in zip(path, other, strict=False):
        if mine != theirs:
            break
        count += 1
    return count


def twice_named(settings: Settings, document: Mapping[str, Any], outlines: Outlines) -> list[Problem]:
    """List varied keys that call a release by a name that more than one of its polygons may have meant.

    Parameters
    ----------
    settings : Settings
        Of a scenario on an elevation model.
    document : mapping
        What stands in its file.
    outlines : mapping
        Polygons by file and layer.
    """
    problems: list[Problem] = []
    for key in settings.varied:
        parts, path = key.split("."), path_of(key, document) or ()
        number = next((part for part in path if isinstance(part, int)), None)
        begin = 2 if parts[1:2] == ["0" if number is None else str(number)] else 1
        name = ".".join(parts[begin:-1])
        if parts[0] != "release" or not name or "each" in path:
            continue
        release = settings.releases[number or 0]
        if not isinstance(release, PolygonsRelease):
            continue
        held = outlines[release.polygons, release.layer]
        count = sum(each.name == name for each in held)
        place: Path = ("sweep", key) if key in settings.sweep else ("sample", "values", key)
        if count > 1:
            wanted = f"expected the name of one polygon, found '{name}' of {count} of {release.polygons}"
            problems.append(Problem(place, f"{wanted}; give each of them a name of its own", at_key=True))
        elif count and release.name is None and len(held) > 1:
            wanted = f"expected the name of a layer or of a polygon, found '{name}', which is that of both"
            fix = f"write release.each.{name}.{parts[-1]} for the polygon"
            problems.append(Problem(place, f"{wanted}; {fix}", at_key=True))
    return problems


def periods_of_polygons(
    settings: Settings, document: Mapping[str, Any], outlines: Outlines
) -> tuple[float, ...] | Problem:
    """Give the return period of each run, years, by the attribute ``return_period`` of what it releases.

    Parameters
    ----------
    settings : Settings
        Of a scenario on an elevation model.
    document : mapping
        What stands in its file.
    outlines : mapping
        Polygons by file and layer.
    """
    data = {name: value for name, value in document.items() if name not in OF_ALL_RUNS}
    runs = design(settings)
    known: dict[tuple[tuple[str, Value], ...], float | Problem] = {}
    found: list[float] = []
    for i in range(len(runs)):
        pairs = zip(runs.keys, runs[i], strict=True)
        varied = tuple((key, value) for key, value in pairs if key.startswith("release"))
        if varied not in known:
            changed: Any = data
            for key, value in varied:
                changed = assign(changed, path_of(key, changed) or (), value)
            known[varied] = _period(Settings.model_validate(changed), outlines)
        period = known[varied]
        if isinstance(period, Problem):
            return period
        found.append(period)
    return tuple(found)


def _period(settings: Settings, outlines: Outlines) -> float | Problem:
    """Return period of the polygons of a run, years, or why it has none."""
    path, years = ("return_periods",), set()
    for release in settings.releases:
        assert isinstance(release, PolygonsRelease)
        for outline in chosen(release.name, outlines[release.polygons, release.layer]):
            period = outline.attributes.get("return_period")
            if not isinstance(period, int | float) or not period > 0:
                wanted = "expected an attribute return_period of each polygon above 0, in years"
                held = with_attributes(outline, "return_period")
                return Problem(path, f"{wanted}, found {held} ({release.polygons})")
            years.add(float(period))
    if len(years) != 1:
        several = " and ".join(f"{year:g}" for year in sorted(years)) or "no polygons"
        return Problem(path, f"expected polygons of one return period in each run, found {several}")
    return years.pop()
