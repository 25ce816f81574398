"""The tables of a stress campaign."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from solver.kernels.runge_kutta import AT_REST, OUT_OF_STEPS, REACHED
from solver.result import REASONS

if TYPE_CHECKING:
    from pipeline.studies.stress.campaign import Row

ENDINGS = {REACHED: "end of time", AT_REST: "rest", OUT_OF_STEPS: "bound of work", **REASONS}
ENDINGS[OUT_OF_STEPS] = "bound of work"
CONFIDENCE = 0.95


class Told(NamedTuple):
    """What a campaign was: its seeds, how they were drawn, bound of work, processes, and time it took, s."""

    seeds: list[int]
    drawn_from: str
    work: float
    workers: int
    seconds: float


def write(rows: list[Row], to: Path, told: Told) -> list[Path]:
    """Write the report as Markdown, and a line a scene as CSV."""
    to.mkdir(parents=True, exist_ok=True)
    report, table = to / "stress.md", to / "stress.csv"
    report.write_text(
        "\n".join([f"# {title(rows, told)}", "", *tables(rows, told, "##"), ""]), encoding="utf-8"
    )
    with table.open("w", newline="", encoding="utf-8") as file:
        table_rows = [_line(row) for row in rows]
        names = dict.fromkeys(name for line in table_rows for name in line)
        writer = csv.DictWriter(file, list(names), restval="")
        writer.writeheader()
        writer.writerows(table_rows)
    return [report, table]


def largest_rate(broken: int, scenes: int) -> float:
    """Upper bound, at 95 %, of the share of scenes that break a law, of which so many of so many did.

    It is the one-sided bound of Clopper and Pearson (1934); with none broken about 3 over the scenes.
    """
    from scipy.stats import beta

    return 1.0 if broken >= scenes else float(beta.ppf(CONFIDENCE, broken + 1, scenes - broken))


def rate(rows: list[Row]) -> str:
    """Tell how many scenes of the conservative form break a law, and how many may at most."""
    run = [row for row in rows if row.conservative and (row.watched is not None or row.broken)]
    broken = sum(bool(row.broken) for row in run)
    share = broken / len(run) if run else 0.0
    bound = largest_rate(broken, len(run))
    return (
        f"{broken} of {len(run)} scenes of the conservative form break a law: a rate of {share:.2g}, "
        f"at most {bound:.2g} at 95 %"
    )


def _line(row: Row) -> dict[str, Any]:
    found = row.watched
    numbers = {
        "number_of_points": found.points if found else "",
        "ending": ENDINGS[found.outcome] if found else "refused" if not row.broken else "error",
        "steps": found.steps if found else "",
        "steps_checked": found.steps_looked_at if found else "",
        "cell_stages": found.work if found else "",
        "seconds": f"{found.wall:.3f}" if found else "",
        "repeated": int(row.repeated),
        "broken": "; ".join(f"{law}: {text}" for law, text in row.broken.items()),
        "reason": row.reason,
    }
    return {"scene": row.drawn.name, **row.drawn.labels, **numbers}


def title(rows: list[Row], told: Told) -> str:
    """Say how many scenes of which seeds there are."""
    if not told.seeds:
        return f"{len(rows)} scenes from files"
    seeds = ", ".join(map(str, told.seeds))
    ending = f", {told.drawn_from}" if told.drawn_from else ""
    return f"{len(rows)} scenes of seed{'s' if len(told.seeds) > 1 else ''} {seeds}{ending}"


def tables(rows: list[Row], told: Told, level: str) -> Iterator[str]:
    """Give the tables of a campaign under headings of a level, ``##`` or deeper."""
    kept, other = ([row for row in rows if row.conservative is c] for c in (True, False))
    yield (
        f"{title(rows, told)}. {rate(rows)}. {len(other)} more are of the collocation form. A scene ends "
        f"after {told.work:.2g} cell-stages. {told.seconds:.0f} s with {told.workers} workers."
    )
    yield from ["", f"{level} Laws", "", *_laws(kept)]
    yield from ["", f"{level} Scenes that break a law", "", *_broken(kept)]
    yield from ["", f"{level} Time steps", "", *_steps(kept)]
    yield from ["", f"{level} Endings", "", *_endings(kept)]
    yield from ["", f"{level} Coverage", "", *_coverage(kept)]
    yield from ["", f"{level} Collocation", "", *_laws(other)]


def _broken(rows: list[Row]) -> Iterator[str]:
    found = [(row.drawn.name, law, text) for row in rows for law, text in row.broken.items()]
    if not found:
        yield "None."
        return
    yield "| scene | law | found |"
    yield "|---|---|---|"
    for name, law, text in found:
        yield f"| {name} | {law} | {text} |"


def _laws(rows: list[Row]) -> Iterator[str]:
    """One line a law: where it was checked, where it was broken, and how near it came to that."""
    found: dict[str, list[float]] = {}
    for row in rows:
        worst = {law: check for law, (check, _) in row.watched.worst.items()} if row.watched else {}
        worst |= {check.law: check for check in row.repeats}
        for law, check in worst.items():
            line = found.setdefault(law, [0, 0, 0, -np.inf, check.limit])
            line[0] += 1
            line[1] += row.watched.checks.get(law, 1) if row.watched else 1
            line[2] += not check.kept
            line[3] = max(line[3], check.value)
    yield "| law | scenes | checks | broken in | largest value, or first beyond | allowed |"
    yield "|---|---|---|---|---|---|"
    for law, (scenes, checks, bad, value, limit) in found.items():
        yield f"| {law} | {scenes:.0f} | {checks:.0f} | {bad:.0f} | {value + 0.0:.3g} | {limit:.3g} |"


def _steps(rows: list[Row]) -> Iterator[str]:
    """Quantiles over the scenes."""
    runs = [row.watched for row in rows if row.watched and row.watched.steps]
    shares = [w.worst["no film sets the step"][0] for w in runs if "no film sets the step" in w.worst]
    lines: dict[str, list[float]] = {
        "steps of a scene": [w.steps for w in runs],
        "steps checked": [w.steps_looked_at for w in runs],
        "cell-stages": [w.work for w in runs],
        "points": [w.points for w in runs],
        "seconds": [w.wall for w in runs],
        "longest over shortest step": [w.longest / w.shortest for w in runs if w.longest > 0],
        "shortest step over the least allowed": [1 / c.value for c in shares if c.value > 0],
    }
    yield "| | least | 10 % | median | 90 % | most |"
    yield "|---|---|---|---|---|---|"
    for name, values in lines.items():
        if values:
            shown = " | ".join(f"{q:.3g}" for q in np.quantile(values, [0, 0.1, 0.5, 0.9, 1]))
            yield f"| {name} | {shown} |"


def _endings(rows: list[Row]) -> Iterator[str]:
    names = [str(_line(row)["ending"]) for row in rows]
    yield "| ending | scenes |"
    yield "|---|---|"
    for name in dict.fromkeys(names):
        yield f"| {name} | {names.count(name)} |"


def _coverage(rows: list[Row]) -> Iterator[str]:
    yield "| of | class | scenes | refused | repeated | steps | broken |"
    yield "|---|---|---|---|---|---|---|"
    for of in dict.fromkeys(of for row in rows for of in row.drawn.labels):
        for name in sorted({row.drawn.labels[of] for row in rows if of in row.drawn.labels}):
            mine = [row for row in rows if row.drawn.labels.get(of) == name]
            steps = sum(row.watched.steps for row in mine if row.watched)
            refused = sum(row.watched is None for row in mine)
            repeated, broken = sum(row.repeated for row in mine), sum(bool(row.broken) for row in mine)
            yield f"| {of} | {name} | {len(mine)} | {refused} | {repeated} | {steps} | {broken} |"
