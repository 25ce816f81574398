"""One table of what a stage costs, alone.

``python -m pipeline.studies.kernels "Elevation models"`` prints it; with the path of a bench.md it takes the
place of the one there.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from pipeline.studies.kernels.table import LAWS, TABLES, lines_of


def put(section: str, report: str) -> str:
    """Put a section with its heading into a report, in place of the one of that heading or at the end."""
    first, *parts = re.split(r"^(?=## )", report, flags=re.MULTILINE)
    heading = section.partition("\n")[0]
    there = [part.partition("\n")[0] == heading for part in parts]
    parts = [section if same else part for part, same in zip(parts, there, strict=True)]
    return "\n\n".join(part.strip() for part in (first, *parts, *[section] * (not any(there)))) + "\n"


def main() -> None:
    """Measure one table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("title", choices=[table.title for table in (*TABLES, LAWS)])
    parser.add_argument("report", type=Path, nargs="?")
    given = parser.parse_args()
    (table,) = (table for table in (*TABLES, LAWS) if table.title == given.title)
    section = "\n".join(lines_of(table))
    print(section)
    if given.report is not None:
        report = given.report.read_text(encoding="utf-8")
        given.report.write_text(put(section, report), encoding="utf-8")


if __name__ == "__main__":
    main()
