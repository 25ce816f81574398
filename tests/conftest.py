import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

os.environ.setdefault("NUMBA_NUM_THREADS", "1")
os.environ.setdefault("MPLBACKEND", "agg")

SCENARIO = """\
name: {name}
description: a box on a plane
terrain: {{profile: plane, angle: 30}}
domain: {{x: [0, 10], y: [-2, 2]}}
points: {{layout: lattice, spacing: 0.5}}
release: {{shape: box, x: [1, 3], y: [-1, 1], height: 0.5}}
material: {{bed_friction: 25, earth_pressure: isotropic}}
time: {{end: 1, output_every: 0.5}}
"""


@pytest.fixture
def scenario_file(tmp_path: Path) -> Callable[..., Path]:
    """Write a small scenario, its bed friction swept over angles, with lines replaced or added."""

    def write(*angles: float, name: str = "box", replace: tuple[str, str] = ("", ""), more: str = "") -> Path:
        sweep = f"sweep: {{material.bed_friction: {list(angles)}}}\n" if angles else ""
        path = tmp_path / f"{name}.yaml"
        path.write_text(SCENARIO.format(name=name).replace(*replace) + sweep + more)
        return path

    return write


@pytest.fixture(scope="session")
def cluster() -> Iterator[object]:
    """Two worker processes for the whole session."""
    from pipeline.batch import workers

    with workers(2) as client:
        yield client


@pytest.fixture
def shared_workers(cluster: object, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let batches use the session's workers instead of starting their own."""

    @contextmanager
    def given(count: int) -> Iterator[object]:
        yield cluster

    monkeypatch.setattr("pipeline.catalogue.workers", given)
