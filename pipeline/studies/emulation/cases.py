"""Scenes that emulated numbers are compared on, with what is drawn and what is asked of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

FIELDS = ["max_depth", "max_speed", "arrival_time", "deposit_depth"]
# keys whose text names a file beside the scenario
FILES = (("terrain", "file"), ("terrain", "elevation"), ("release", "polygons"), ("receptors", None))
TORRENT_FRICTION = {
    "material.bed_friction": {"distribution": "triangular", "lower": 6, "mode": 6.5, "upper": 10},
    "material.turbulent_friction": {"distribution": "uniform", "lower": 150, "upper": 500},
}
TORRENT: dict[str, dict[str, Any]] = {
    # all of its surface: to look for the domain takes as long as the runs
    "domain": {"x": [2_600_000, 2_601_600], "y": [1_199_800, 1_200_520]},
    "time": {"end": 900, "output_every": 900},
}


@dataclass(frozen=True)
class Case:
    """Many runs of a scene.

    Parameters
    ----------
    name : str
        Of the case, and of its scenarios with the spacing behind it.
    file : Path
        Scenario that it is made from.
    truth : mapping of float to int
        Runs by spacing, m, the widest first.
    sections : mapping
        Sections of the file that are changed, key by key.
    values : mapping
        What is drawn, in place of what the file draws.
    asked : mapping
        Section ``hazard``.
    arrival : tuple of float
        Times that something arrives before, s; what a run gives of it is tried too.
    few : tuple of int
        Runs that are emulated.
    """

    name: str
    file: Path
    truth: Mapping[float, int]
    sections: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    values: Mapping[str, Any] | None = None
    asked: Mapping[str, Any] | None = None
    arrival: tuple[float, ...] = ()
    few: tuple[int, ...] = (64,)

    def scenario(self, spacing: float, count: int | None = None) -> dict[str, Any]:
        """Give the scene on a spacing, with many Sobol draws."""
        content: dict[str, Any] = yaml.safe_load(self.file.read_text(encoding="utf-8"))
        content = with_absolute_files(content, self.file.parent)
        for section, changed in self.sections.items():
            content[section] = content.get(section, {}) | dict(changed)
        for section in ("sweep", "return_periods"):
            content.pop(section, None)
        content["name"] = self.named(spacing)
        content["points"] = content["points"] | {"spacing": spacing}
        content["output"] = content.get("output", {}) | {"fields": FIELDS}
        sample = content.get("sample", {}) if self.values is None else {"values": dict(self.values)}
        content["sample"] = sample | {"design": "sobol", "count": count or self.truth[spacing]}
        if self.asked is not None:
            content["hazard"] = dict(self.asked)
        return content

    def named(self, spacing: float) -> str:
        """Name of the scenario of a spacing."""
        return f"{self.name}-{spacing:g}m"


def with_absolute_files(content: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Give a scenario whose files are named from the root, so that it may lie anywhere."""
    for section, key in FILES:
        held = content if key is None else content.get(section, {})
        named = held.get(key or section)
        if isinstance(named, str):
            held[key or section] = str((folder / named).resolve())
    return content


VALLEY = Case("valley", Path("scenarios/valley/valley.yaml"), {8.0: 4096, 4.0: 1024, 2.0: 128})
TORRENT_CASE = Case(
    "torrent",
    Path("scenarios/torrent/torrent.yaml"),
    {12.0: 512},
    sections=TORRENT,
    values={
        "release.volume": {
            "distribution": "lognormal", "median": 14000, "deviation": 0.5, "lower": 4000, "upper": 40000,
        },
        **TORRENT_FRICTION,
    },
    asked={"depth": [0.25, 0.5, 1], "speed": [1, 3, 8], "pressure": [3, 30]},
    arrival=(60.0, 120.0),
)  # fmt: skip
OTHERS = (
    TORRENT_CASE,
    replace(
        TORRENT_CASE,
        name="words",
        truth={12.0: 256},
        sections={**TORRENT, "material": {"internal_friction": 30}},
        values={
            "release.name": {"distribution": "discrete", "values": ["slide", "niche"], "weights": [2, 1]},
            "material.earth_pressure": {
                "distribution": "discrete", "values": ["isotropic", "mohr-coulomb-flow"],
            },
            "release.volume": {"distribution": "discrete", "values": [6000, 12000, 18000, 30000]},
            **TORRENT_FRICTION,
        },
    ),
    Case(
        "six",
        Path("scenarios/chute.yaml"),
        {0.4: 2048},
        sections={
            "domain": {"x": [0, 34], "y": [-8, 8]},
            "output": {"threshold": 0.05},
            "boundaries": {"y_min": "open", "y_max": "open"},
            "time": {"end": 60, "output_every": 60},
        },
        values={
            "release.volume": {
                "distribution": "lognormal", "median": 12, "deviation": 0.5, "lower": 4, "upper": 36,
            },
            "material.bed_friction": {"distribution": "triangular", "lower": 22, "mode": 27, "upper": 33},
            "material.internal_friction": {"distribution": "uniform", "lower": 33, "upper": 42},
            "material.turbulent_friction": {"distribution": "uniform", "lower": 200, "upper": 2000},
            "terrain.angle": {"distribution": "uniform", "lower": 36, "upper": 42},
            "terrain.runout_angle": {"distribution": "uniform", "lower": 0, "upper": 8},
        },
        asked={"depth": [0.05, 0.1, 0.2], "speed": [1, 2]},
        arrival=(12.0, 18.0),
    ),
)  # fmt: skip
CASES = {case.name: case for case in (VALLEY, *OTHERS)}
