"""The benchmark as files: a CSV, a page of Markdown and a picture of error against processor time."""

from __future__ import annotations

import csv
import os
import platform
import re
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from importlib.metadata import version
from math import isnan
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from pipeline.studies.kernels.table import LAWS, TABLES, lines_of
from pipeline.studies.ladders import FULL, PLAIN, QUICK, Plan, Row, climb, cost_at, ending, skipping
from solver.warmup import compile_kernels

# Relative L2 of depth at which costs are compared, and on which case.
WANTED = (1e-2, 5e-3, 2e-3, 1e-3)
# How far outside the errors measured a line is believed, as a factor.
BEYOND = 2
COMPARED = "frictionless cap"
VERSIONS = ("lmls", "numpy", "scipy", "numba", "llvmlite")
STYLES = {
    ("weighted-residual", "lattice"): ("tab:blue", "o"),
    ("weighted-residual", "cloud"): ("tab:orange", "s"),
    ("collocation", "lattice"): ("tab:green", "^"),
    ("collocation", "cloud"): ("tab:red", "v"),
    PLAIN: ("0.5", "x"),
}

LADDER, READ_OFF, SKIPPED, ENDS = "Ladder", "Time to an error", "Skipped", "End times"
Column = tuple[str, int, Callable[[Row], str]]
COST: tuple[Column, ...] = (
    ("steps", 6, lambda r: str(r.steps)),
    ("cell-stages", 11, lambda r: str(r.cell_stages)),
    ("CPU s", 8, lambda r: f"{r.cpu_time:.4f}"),
    ("million a s", 11, lambda r: f"{r.rate / 1e6:.1f}"),
)
ERRORS: tuple[Column, ...] = (
    ("depth L2", 8, lambda r: f"{r.depth:.2e}"),
    ("momentum L2", 11, lambda r: f"{r.momentum:.2e}"),
    ("depth L1", 8, lambda r: f"{r.depth_l1:.2e}"),
    ("volume", 7, lambda r: f"{r.volume_error:.0e}"),
)
MEMORY: Column = ("MB", 6, lambda r: f"{r.memory / 1e6:.1f}")
LADDER_COLUMNS: tuple[Column, ...] = (
    ("case", 17, lambda r: r.case),
    ("form", 17, lambda r: r.form),
    ("layout", 7, lambda r: r.layout),
    ("spacing", 7, lambda r: f"{r.spacing:g}"),
    ("points", 6, lambda r: str(r.points)),
    *COST,
    ("set-up s", 8, lambda r: f"{r.setup_time:.3f}"),
    *ERRORS,
    MEMORY,
)
SKIPPED_COLUMNS: tuple[Column, ...] = (
    ("chute", 31, lambda r: r.variant),
    ("points", 6, lambda r: str(r.points)),
    *COST,
    ("depth L2", 12, lambda r: f"{r.depth:.6e}"),
    MEMORY,
)
END_COLUMNS: tuple[Column, ...] = (("end, s", 6, lambda r: f"{r.time:g}"), *COST)


def bench(
    to: Path, tell: Callable[[str], None], *, quick: bool = False, plan: Plan | None = None
) -> list[Path]:
    """Run the benchmark and write it.

    Parameters
    ----------
    to : Path
        Folder for bench.csv, bench.md and bench.png; made where it is missing.
    tell : callable
        Told each line of bench.md as soon as it is known.
    quick : bool
        Run coarse spacings alone.
    plan : Plan, optional
        What to run instead.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    OSError
        If something cannot be written.
    """
    to.mkdir(parents=True, exist_ok=True)
    rows: list[Row] = []
    lines: list[str] = []
    for line in _report(plan or (QUICK if quick else FULL), rows):
        tell(line)
        lines.append(line)
    written = [to / f"bench.{suffix}" for suffix in ("csv", "md", "png")]
    _write_table(rows, written[0])
    written[1].write_text("\n".join(lines) + "\n", encoding="utf-8")
    _draw(rows, written[2])
    return written


def _report(plan: Plan, rows: list[Row]) -> Iterator[str]:
    """Run a plan, filling ``rows``, and give bench.md line by line."""
    yield f"{machine()}."
    compile_kernels()

    def kept(made: Iterable[Row]) -> Iterator[Row]:
        for row in made:
            rows.append(row)
            yield row

    yield from _heading(LADDER, LADDER_COLUMNS)
    for ladder in plan.ladders:
        case = ladder.known()
        yield from _lines(kept(climb(ladder, case)), LADDER_COLUMNS)
    yield from _heading(SKIPPED, SKIPPED_COLUMNS)
    yield from _lines(kept(skipping(ladder, case, plan.spacing)), SKIPPED_COLUMNS)
    yield from _heading(ENDS, END_COLUMNS)
    yield from _lines(kept(ending(ladder, plan.spacing, plan.end_times)), END_COLUMNS)
    yield from _read_off(rows)
    for table in (*TABLES, *([LAWS] if plan.laws else [])):
        yield ""
        yield from lines_of(table)


def machine() -> str:
    """Say what the benchmark runs on: processor, cores and versions."""
    model = platform.processor() or platform.machine()
    information = Path("/proc/cpuinfo")
    if information.exists():
        named = re.search(r"^model name\s*:\s*(.+)$", information.read_text(), flags=re.MULTILINE)
        model = named[1] if named else model
    versions = ", ".join(f"{name} {version(name)}" for name in VERSIONS)
    return f"{model}, one thread on {os.cpu_count()} cores; Python {platform.python_version()}, {versions}"


def _heading(title: str, columns: tuple[Column, ...]) -> Iterator[str]:
    yield from ("", f"## {title}", "")
    yield _line(name.ljust(max(width, len(name))) for name, width, _ in columns)
    yield _line("-" * max(width, len(name)) for name, width, _ in columns)


def _lines(rows: Iterable[Row], columns: tuple[Column, ...]) -> Iterator[str]:
    for row in rows:
        yield _line(text(row).ljust(max(width, len(name))) for name, width, text in columns)


def _line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _read_off(rows: list[Row]) -> Iterator[str]:
    """Table CPU seconds at equal errors, and those over the plain scheme's.

    A tilde marks what lies a little outside the errors measured.
    """
    yield from ("", f"## {READ_OFF}", "")
    titles = ["relative L2 of depth", *(f"{error:.0e}" for error in WANTED)]
    yield _line([titles[0].ljust(34), *(title.ljust(9) for title in titles[1:])])
    yield _line(["-" * 34, *("-" * 9 for _ in WANTED)])
    kinds = _kinds([r for r in rows if r.case == COMPARED and not r.variant])
    found = {kind: [_cost(line, error) for error in WANTED] for kind, line in kinds.items() if len(line) > 1}
    plain = found.pop(PLAIN, [None] * len(WANTED))
    for kind, costs in {PLAIN: plain, **found}.items():
        yield _line([", ".join(kind).ljust(34), *(_shown(cost).ljust(9) for cost in costs)])
    for kind, costs in found.items():
        cells = [_shown(a and b and (a[0] / b[0], a[1] and b[1])) for a, b in zip(costs, plain, strict=True)]
        yield _line([f"{', '.join(kind)}, ratio".ljust(34), *(cell.ljust(9) for cell in cells)])


def _cost(line: list[Row], wanted: float) -> tuple[float, bool] | None:
    """Read off the cost at an error, and whether it is within those measured; None far outside."""
    errors, costs = [row.depth for row in line], [row.cpu_time for row in line]
    if not min(errors) / BEYOND <= wanted <= max(errors) * BEYOND:
        return None
    return cost_at(errors, costs, wanted)


def _shown(cost: tuple[float, bool] | None) -> str:
    return "-" if cost is None else f"{'' if cost[1] else '~'}{cost[0]:.2g}"


def _kinds(rows: Iterable[Row]) -> dict[tuple[str, str], list[Row]]:
    """Sort rows by form and layout."""
    found: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        found.setdefault((row.form, row.layout), []).append(row)
    return found


def _write_table(rows: list[Row], path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        values = [asdict(row) | {"cell_stages_per_second": row.rate} for row in rows]
        writer = csv.DictWriter(file, list(values[0]))
        writer.writeheader()
        for value in values:
            writer.writerow({k: "" if isinstance(v, float) and isnan(v) else v for k, v in value.items()})


def _draw(rows: list[Row], path: Path) -> None:
    """Draw error against processor time, a panel a case, depth in full lines and momentum in dashed ones."""
    ladder = [row for row in rows if not row.variant]
    cases = list(dict.fromkeys(row.case for row in ladder))
    across = min(2, len(cases))
    down = -(-len(cases) // across)
    figure = Figure(figsize=(5.6 * across, 4.3 * down + 0.6), layout="compressed", dpi=150)
    panels = figure.subplots(down, across, squeeze=False).flat
    for panel, case in zip(panels, cases, strict=False):
        _panel(panel, case, [row for row in ladder if row.case == case])
    for panel in list(panels)[len(cases) :]:
        panel.set_visible(False)
    figure.supxlabel("processor time of the time loop (s)", fontsize="medium")
    figure.supylabel("relative L2 error of depth (full) and momentum (dashed)", fontsize="medium")
    handles = [
        Line2D([], [], color=colour, marker=mark, label=", ".join(kind))
        for kind, (colour, mark) in STYLES.items()
    ]
    handles += [
        Line2D([], [], color="k", linestyle=(0, (3, 2)), linewidth=0.9, label="momentum"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=3, frameon=False, fontsize="small")
    figure.savefig(path)


def _panel(panel: Axes, case: str, rows: list[Row]) -> None:
    for kind, line in _kinds(rows).items():
        colour, mark = STYLES[kind]
        cost = [row.cpu_time for row in line]
        panel.loglog(
            cost, [row.depth for row in line], color=colour, marker=mark, markersize=4.5, linewidth=1.6
        )
        panel.loglog(
            cost,
            [row.momentum for row in line],
            color=colour,
            linestyle=(0, (3, 2)),
            linewidth=0.9,
            alpha=0.8,
        )
        for row in line:
            panel.annotate(
                f"{row.spacing:g}",
                (row.cpu_time, row.depth),
                (0, -10),
                textcoords="offset points",
                horizontalalignment="center",
                fontsize="xx-small",
                color=colour,
            )
    panel.set_title(f"{case}, labels: spacing in m", fontsize="medium", loc="left")
    # a panel may span less than a decade of errors
    panel.yaxis.set_major_locator(LogLocator(10, subs=(1, 2, 5), numticks=12))
    panel.xaxis.set_major_locator(LogLocator(10, numticks=12))
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.set_minor_formatter(NullFormatter())
    panel.grid(which="major", alpha=0.35)
    panel.grid(which="minor", alpha=0.12)


def insert(report: str, page: str) -> str:
    """Put sections of bench.md between the marks of a page that name them.

    A mark is ``<!-- bench: TITLE -->``, and what belongs to it ends with ``<!-- end -->``; the machine's is
    ``<!-- bench: Machine -->``.

    Raises
    ------
    ValueError
        If the page names a section that is not there.
    """
    top, *parts = re.split(r"^## ", report, flags=re.MULTILINE)
    sections = {"Machine": top.strip()}
    for part in parts:
        title, _, body = part.partition("\n")
        sections[title] = body.strip()

    def filled(match: re.Match[str]) -> str:
        if match[1] not in sections:
            raise ValueError(f"bench.md has no section {match[1]}")
        return f"<!-- bench: {match[1]} -->\n{sections[match[1]]}\n<!-- end -->"

    return re.sub(r"<!-- bench: ([^>]+) -->\n.*?<!-- end -->", filled, page, flags=re.DOTALL)


if __name__ == "__main__":
    given, into = (Path(argument) for argument in sys.argv[1:])
    into.write_text(
        insert(given.read_text(encoding="utf-8"), into.read_text(encoding="utf-8")), encoding="utf-8"
    )
