import subprocess
import sys

import netCDF4
import numpy as np
import pytest
import shapely

from pipeline.mistakes import BadInput
from pipeline.runs.runs import expand, share
from pipeline.runs.scene_of_run import build_scene
from pipeline.runs.shared_points import kept
from pipeline.runs.shared_points import load as load_points
from pipeline.scenario import solver_objects
from pipeline.scenario.scenario import load
from solver.points.cloud import random_points
from solver.points.lattice import Lattice

LATTICE = "{layout: lattice, spacing: 0.5}"
X, Y = (0.0, 10.0), (-2.0, 2.0)


@pytest.fixture
def scenario(scenario_file):
    return lambda points, **options: load([scenario_file(replace=(LATTICE, points), **options)])[0]


def points_of(scenario):
    return solver_objects.points(scenario.settings, scenario.points)


def refusal(scenario, points):
    with pytest.raises(BadInput) as refused:
        scenario(points)
    (mistake,) = refused.value.mistakes
    return f"{mistake.line}:{mistake.column}: {mistake.key}: {mistake.message}"


@pytest.mark.parametrize("law", ["count: 500", "spacing: 0.282842712474619"])
def test_poisson_disc_points_are_those_of_the_solver(scenario, law):
    cloud = points_of(scenario(f"{{layout: poisson-disc, {law}, seed: 7}}"))
    assert abs(len(cloud) - 500) <= 5
    if law.startswith("count"):
        np.testing.assert_array_equal(cloud.points, random_points(X, Y, 500, 7).points)


def test_graded_points_stand_closer_in_their_regions(scenario):
    cloud = points_of(
        scenario(
            "{layout: graded, spacing: 0.5, growth: 0.2, "
            "refine: [{region: {x: [2, 4], y: [-1, 1]}, spacing: 0.1}]}"
        )
    )
    x, y = cloud.points.T
    inside = (x > 2.1) & (x < 3.9) & (np.abs(y) < 0.9)
    assert cloud.cell_area[inside].mean() == pytest.approx(0.01, rel=0.1)
    assert cloud.cell_area[x > 8].mean() == pytest.approx(0.25, rel=0.25)
    assert cloud.cell_area.sum() == pytest.approx(40, rel=1e-13)


def test_graded_points_follow_a_line(scenario):
    cloud = points_of(
        scenario(
            "{layout: graded, spacing: 0.5, growth: 0.2, "
            "refine: [{line: [[1, -1], [5, 1], [9, 1]], margin: 0.3, spacing: 0.1}]}"
        )
    )
    away = shapely.distance(shapely.points(cloud.points), shapely.LineString([[1, -1], [5, 1], [9, 1]]))
    assert cloud.cell_area[away < 0.2].mean() == pytest.approx(0.01, rel=0.1)
    assert cloud.cell_area[away < 0.2].max() < 0.03
    assert cloud.cell_area[away > 1.9].min() > 0.08


@pytest.mark.parametrize(
    ("receptor", "same"),
    [
        ("line: [[1, -1], [5, 1]]", "{line: [[1, -1], [5, 1]], margin: 0.3, spacing: 0.1}"),
        ("point: [3, 0]", "{region: {x: [2.7, 3.3], y: [-0.3, 0.3]}, spacing: 0.1}"),
        ("polygon: [[2, 0], [4, 0], [3, 1]]", "{region: {x: [1.7, 4.3], y: [-0.3, 1.3]}, spacing: 0.1}"),
    ],
)
def test_graded_points_follow_a_receptor(scenario, receptor, same):
    layout = "{{layout: graded, spacing: 0.5, growth: 0.2, refine: [{}]}}"
    named = scenario(
        layout.format("{receptor: school, margin: 0.3, spacing: 0.1}")
        + f"\nreceptors: [{{name: school, {receptor}}}]"
    )
    there = scenario(layout.format(same))
    np.testing.assert_array_equal(points_of(named).points, points_of(there).points)
    assert named.digest == there.digest
    (run,) = expand(named)
    assert run.settings.points == there.settings.points


@pytest.mark.parametrize("suffix", ["csv", "nc"])
def test_points_of_a_file_are_taken_as_they_are(scenario, tmp_path, suffix):
    given = random_points(X, Y, 300, 1).points
    path = tmp_path / f"points.{suffix}"
    if suffix == "csv":
        rows = (f"{i},{x!r},{y!r}" for i, (x, y) in enumerate(given.tolist()))
        path.write_text("\n".join(["number,x,y", *rows]))
    else:
        with netCDF4.Dataset(path, "w") as data:
            data.createDimension("n", len(given))
            for name, values in zip("xy", given.T, strict=True):
                data.createVariable(name, "f8", ("n",))[:] = values
    loaded = scenario(f"{{layout: file, path: points.{suffix}}}")
    found = points_of(loaded).points
    np.testing.assert_array_equal(found[np.lexsort(found.T)], given[np.lexsort(given.T)])
    before = loaded.digest
    if suffix == "csv":
        path.write_text(path.read_text().replace("number", "n"))
        assert scenario(f"{{layout: file, path: points.{suffix}}}").digest == before
        path.write_text("\n".join(path.read_text().splitlines()[:-1]))
        assert scenario(f"{{layout: file, path: points.{suffix}}}").digest != before


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("1,0\n2,1\nx,1\n", "points.csv:4:1: x: expected a finite number, found 'x'"),
        ("1,0\n2,1\n3,\n", "points.csv:4:1: y: expected a finite number, found ''"),
        ("1,0\n2,1\n3,1,4,5\n", "points.csv:4:1: expected 2 values a line, one a heading, found 4"),
    ],
)
def test_a_bad_file_of_points_is_told_by_line(scenario, tmp_path, rows, message):
    (tmp_path / "points.csv").write_text("x,y\n" + rows)
    with pytest.raises(BadInput) as refused:
        scenario("{layout: file, path: points.csv}")
    assert message in str(refused.value)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ("1,0\n2,1\n3,1\n2,1\n", "points coincide: 1 at (2, 1), 3 at (2, 1)"),
        ("1,0\n2,1\n30,1\n", "points outside the domain: 2 at (30, 1)"),
        ("1,0\n2,0\n3,0\n", "all 3 points lie on one line, from 0 at (1, 0), 2 at (3, 0)"),
    ],
)
def test_points_that_do_not_fit_are_named_before_anything_is_written(scenario, tmp_path, points, message):
    (tmp_path / "points.csv").write_text("x,y\n" + points)
    told = refusal(scenario, "{layout: file, path: points.csv}")
    assert told.startswith("5:30: points.path: expected points that fit, found ")
    assert message in told


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ("{layout: poisson-disc}", "1: points.count: expected either count or spacing, found nothing"),
        (
            "{layout: poisson-disc, count: 9, spacing: 1}",
            "39: points.count: expected either count or spacing, found both",
        ),
        ("{layout: poisson-disc, count: 2}", "39: points.count: expected a number of at least 3, found 2"),
        ("{layout: poisson-disc, count: 9.5}", "39: points.count: expected a whole number, found 9.5"),
        (
            "{layout: poisson-disc, spacing: 1e-4}",
            "41: points.spacing: expected at most 10,000,000 points, found 4e+09",
        ),
        (
            "{layout: graded, spacing: 1, refine: []}",
            "46: points.refine: expected 1 or more values, found 0",
        ),
        (
            "{layout: graded, spacing: 1, refine: [{spacing: 0.1}]}",
            "47: points.refine.0.region: expected one of region, line and receptor, found nothing",
        ),
        (
            "{layout: graded, spacing: 1, refine: [{line: [[0, 1]], spacing: 0.1}]}",
            "54: points.refine.0.line: expected 2 or more corners, found 1",
        ),
        (
            "{layout: graded, spacing: 1, refine: [{region: {x: [0, 1], y: [0, 1]}, margin: 1, spacing: 1}]}",
            "88: points.refine.0.margin: expected no margin with region, found one",
        ),
        (
            "{layout: graded, spacing: 1, refine: [{receptor: school, spacing: 0.1}]}",
            "58: points.refine.0.receptor: expected the name of a receptor in the domain (there are none), "
            "found 'school'",
        ),
        (
            "{layout: file, path: none.csv}",
            "30: points.path: expected a readable file, found none: ",
        ),
        (
            "{layout: poisson-disc, count: 99, form: 3}",
            "43: points.form: expected one of the keys layout, count, spacing, seed, found 'form'",
        ),
    ],
)
def test_a_mistake_in_the_points_is_told_with_its_place(scenario, points, message):
    assert refusal(scenario, points).startswith(f"5:{message}")


def test_points_are_made_once_and_shared_by_file(scenario, tmp_path):
    loaded = scenario(
        "{layout: poisson-disc, count: 300}", more="sweep: {scheme.support: [7, 9], gravity: [5, 9]}\n"
    )
    runs = expand(loaded)
    shared = share(loaded, runs)
    assert len(shared.operators) == 2
    path = tmp_path / "points"
    with kept(shared, path) as carried:
        assert carried == path
        read = load_points(carried)
        assert load_points(carried) is read
        scenes = [build_scene(run, read).scene for run in runs]
    assert not path.exists()
    assert all(scene.points is scenes[0].points for scene in scenes)
    assert scenes[0].operators is scenes[1].operators
    assert [scene.operators.support for scene in scenes] == [7, 7, 9, 9]


def test_a_lattice_needs_no_file(scenario, tmp_path):
    loaded = scenario(LATTICE)
    shared = share(loaded, expand(loaded))
    with kept(shared, tmp_path / "points") as carried:
        assert load_points(carried) is shared
        assert isinstance(carried.points, Lattice)
    assert not any(tmp_path.glob("points"))


def test_a_support_that_cannot_carry_the_basis_is_told_before_anything_is_written(scenario_file, tmp_path):
    x = [f"{0.5 + 9 * i / 40},{y}" for i in range(41) for y in (-1, 1)]
    (tmp_path / "points.csv").write_text("\n".join(["x,y", *x]))
    file = scenario_file(
        replace=(LATTICE, "{layout: file, path: points.csv}"), more="scheme: {support: 5, degree: 1}\n"
    )
    command = [sys.executable, "-m", "pipeline", "run", file, "--out", tmp_path / "out"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert (
        f"{file}:5:9: points: expected points that fit, found the nearest 5 points cannot carry"
        in done.stderr
    )
    assert not list((tmp_path / "out").glob("*.zarr"))


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (
            "scheme: {form: galerkin}",
            "9:16: scheme.form: expected one of weighted-residual, collocation, found 'galerkin'",
        ),
        (
            "scheme: {form: collocation, support: 4}",
            "9:38: scheme.support: expected a number of at least 6, found 4",
        ),
        (
            "scheme: {form: collocation}\nboundaries: {x_min: {depth: 0.1}}",
            "10:21: boundaries.x_min: expected open, wall or no-slip with form collocation, "
            "found a given depth",
        ),
    ],
)
def test_a_mistake_in_the_scheme_is_told_with_its_place(scenario_file, lines, message):
    with pytest.raises(BadInput) as refused:
        load([scenario_file(more=f"{lines}\n")])
    assert str(refused.value).endswith(message)
