import csv
import re
from dataclasses import replace

import numpy as np
import pytest
from root import ROOT
from typer.testing import CliRunner

from pipeline.cli.app import app
from pipeline.studies import bench
from pipeline.studies.kernels import laws
from pipeline.studies.kernels.__main__ import put
from pipeline.studies.kernels.table import TABLES
from pipeline.studies.ladders import Ladder, Plan, cost_at
from solver.physics import friction
from solver.points.cloud import random_points
from solver.points.lattice import Lattice
from solver.scene import Collocation, WeightedResidual
from solver.verification.cases import CHUTE, cap, measure
from solver.verification.fine_solution import fine_solution, overlap

FIRST = ("weighted-residual", "lattice")
# the chute, so wide that the flow does not come to the walls
WIDE = replace(CHUTE, y=(-10.0, 10.0))
TINY = Plan(
    (
        Ladder(
            "frictionless cap",
            cap(),
            {
                ("weighted-residual", "lattice"): (16, 8),
                ("weighted-residual", "cloud"): (16, 8),
                ("collocation", "lattice"): (32, 16),
            },
            beside_plain=True,
        ),
        Ladder("chute", WIDE, {("weighted-residual", "lattice"): (1.6, 0.8)}, fine=True),
    ),
    1.0,
    (1.0, 2.0),
)


@pytest.fixture(scope="module")
def benched(tmp_path_factory):
    """A tiny benchmark by the command: its folder, and what was printed."""
    to = tmp_path_factory.mktemp("bench") / "new"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bench, "QUICK", TINY)
        patch.setattr("pipeline.studies.ladders.ENOUGH", 0.0)
        patch.setattr("pipeline.studies.kernels.surface.SIDES", {40: 20})
        shown = CliRunner().invoke(app, ["bench", "--quick", "--to", str(to)], catch_exceptions=False)
    assert shown.exit_code == 0
    with (to / "bench.csv").open() as file:
        return to, shown.stdout, list(csv.DictReader(file))


def test_the_bench_writes_a_table_a_page_and_a_picture(benched):
    to, printed, _ = benched
    assert sorted(path.name for path in to.iterdir()) == ["bench.csv", "bench.md", "bench.png"]
    assert (to / "bench.png").read_bytes().startswith(b"\x89PNG")
    page = (to / "bench.md").read_text()
    assert printed.startswith(page)
    assert "one thread" in page
    assert "numba 0." in page
    titles = bench.LADDER, bench.READ_OFF, bench.SKIPPED, bench.ENDS, *(table.title for table in TABLES)
    for title in titles:
        (section,) = re.findall(rf"^## {title}\n\n((?:\|.*\n)+)", page, flags=re.MULTILINE)
        assert len({line.count("|") for line in section.splitlines()}) == 1
    assert len(re.findall(r"^\| collocation, lattice +\|", page, flags=re.MULTILINE)) == 1


def test_every_law_of_friction_is_timed_beside_dry_friction():
    assert {type(law) for law in laws.MEASURED.values()} == set(friction.LAWS)
    assert next(iter(laws.MEASURED)) == "coulomb"
    some = {name: laws.MEASURED[name] for name in ("coulomb", "voellmy")}
    first, second = costs = laws.law_costs(some, spacing=4.0, repeats=3)
    assert [each.name for each in costs] == ["coulomb", "voellmy"]
    # every cell in every stage, of which there are three
    assert first.cell_stages == 3 * first.steps * int(
        np.prod(laws.scene_of(some["coulomb"], 4.0).points.shape)
    )
    assert first.beside(first) == (1.0, 1.0, 1.0)
    known = [
        (b / second.cell_stages) * first.cell_stages / a
        for a, b in zip(first.times, second.times, strict=True)
    ]
    assert second.beside(first) == pytest.approx(known)
    assert second.rate == pytest.approx(second.cell_stages / np.median(second.times))


def section(path, title):
    """Give the cells of the lines of a table."""
    _, _, after = path.read_text().partition(f"## {title}\n\n")
    lines = after.partition("\n\n")[0].strip().splitlines()
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]


def test_the_loops_of_a_stage_are_timed_and_their_instructions_counted(benched):
    rows = section(benched[0] / "bench.md", TABLES[0].title)
    kernels, (whole, *_, taken, alone) = rows[2:-1], rows[-1]
    assert {row[0] for row in kernels} >= {"face_values", "hll", "update_row"}
    # a divider is a part of what a loop is made of
    assert sum(int(row[4]) + int(row[5]) for row in kernels) >= 4
    assert all(int(row[3]) > int(row[4]) + int(row[5]) for row in kernels)
    assert float(taken) == pytest.approx(sum(float(row[6]) for row in kernels), abs=0.05)
    assert float(alone) > 0
    assert whole.endswith("million a s")


def test_the_loops_of_a_stage_on_a_cloud_are_timed_and_what_they_move_is_counted(benched):
    *loops, whole, stage = section(benched[0] / "bench.md", TABLES[1].title)[2:]
    assert [row[0] for row in loops] == ["slopes_at", "fluxes_through", "add_up", "update_run"]
    assert stage[0].startswith("cloud_stage: ")
    for column in (1, 2, 3, 4, 5):
        sums = sum(float(row[column]) for row in loops)
        assert float(whole[column]) == pytest.approx(sums, abs=2.1)
        assert sums > 0
    # eight neighbours of three values each; three faces a cell of twelve values on either side
    looked_up = [int(row[3]) for row in loops]
    assert looked_up[0] == pytest.approx(24, rel=0.01)
    assert looked_up[1] == pytest.approx(72, rel=0.05)
    assert looked_up[3] == 0


def test_stages_on_elevation_models_are_timed_beside_those_on_a_profile(benched):
    profile, *models = section(benched[0] / "bench.md", TABLES[2].title)[2:]
    assert profile[0] == "slope profile"
    assert float(profile[4]) == 1
    assert [row[0] for row in models] == ["elevation model, plane", "elevation model, rough"]
    for row in models:
        assert row[1] == "1600"
        assert float(row[2]) * float(row[3]) == pytest.approx(1000, rel=0.02)
        assert float(row[4]) > 0


def test_a_table_takes_the_place_of_the_one_of_its_heading():
    report = "A machine.\n\n## One\n\n| a |\n\n## Two\n\n| b |\n"
    assert put("## One\n\n| c |", report) == report.replace("a |", "c |")
    assert put("## Three\n\n| c |", report) == f"{report}\n## Three\n\n| c |\n"


def test_errors_fall_with_the_spacing_in_every_form_and_layout(benched):
    rows = [row for row in benched[2] if not row["variant"]]
    assert len(rows) == 10
    for coarse, fine in zip(rows[::2], rows[1::2], strict=True):
        assert [coarse[k] for k in ("case", "form", "layout")] == [
            fine[k] for k in ("case", "form", "layout")
        ]
        assert int(fine["cell_stages"]) > int(coarse["cell_stages"])
        for norm in ("depth", "momentum", "depth_l1"):
            assert 0 < float(fine[norm]) < float(coarse[norm])
    for row in rows:
        assert abs(float(row["volume_error"])) <= 1e-14
        assert float(row["cpu_time"]) > 0
        assert int(row["repeats"]) >= 3
        assert int(row["memory"]) > 3 * 8 * int(row["points"])


def test_times_to_an_error_stand_over_those_of_the_plain_scheme(benched):
    to, _, rows = benched
    _, _, *table = section(to / "bench.md", bench.READ_OFF)
    costs = {name: cells for name, *cells in table}
    plain = [r for r in rows if r["form"] == "plain MUSCL-HLL"]
    # by as many repeats as what it took turns with
    turns = [r for r in rows if (r["case"], r["form"], r["layout"]) == (bench.COMPARED, *FIRST)]
    assert [r["repeats"] for r in plain] == [r["repeats"] for r in turns]
    assert len(costs) == 4 + 3
    for name, cells in costs.items():
        if name.endswith(", ratio"):
            own, plain_ones = costs[name.removesuffix(", ratio")], costs["plain MUSCL-HLL, lattice"]
            for ratio, one, other in zip(cells, own, plain_ones, strict=True):
                assert (ratio == "-") == ("-" in (one, other))
                if ratio != "-":
                    known = float(one.strip("~")) / float(other.strip("~"))
                    # of numbers of two digits
                    assert float(ratio.strip("~")) == pytest.approx(known, rel=0.12)


def test_what_is_skipped_is_work_and_not_the_result(benched):
    rows = {row["variant"]: row for row in benched[2] if row["time"] == "24.0"}
    own, doubled = rows["nothing skipped"], rows["domain doubled, nothing skipped"]
    for some, whole in ((rows["as it is"], own), (rows["domain doubled"], doubled)):
        assert [some[k] for k in ("steps", "depth")] == [whole[k] for k in ("steps", "depth")]
        assert int(some["cell_stages"]) < 0.6 * int(whole["cell_stages"])
    assert rows["as it is"]["steps"] == rows["domain doubled"]["steps"]
    assert float(rows["as it is"]["depth"]) == pytest.approx(float(rows["domain doubled"]["depth"]), rel=1e-9)


def test_runs_to_an_end_time_are_compared_with_nothing(benched):
    rows = [row for row in benched[2] if row["variant"] == "end time"]
    assert [float(row["time"]) for row in rows] == [1, 2]
    assert [row["depth"] for row in rows] == ["", ""]


def test_the_cost_at_an_error_is_exact_on_a_power_law():
    errors = [1e-1, 1e-3, 1e-2]
    costs = [3 * error**-1.5 for error in errors]
    for wanted, inside in ((0.05, True), (1e-3, True), (5e-3, True), (2e-4, False), (0.5, False)):
        cost, within = cost_at(errors, costs, wanted)
        assert cost == pytest.approx(3 * wanted**-1.5, rel=1e-12)
        assert within == inside
    with pytest.raises(ValueError, match="one error"):
        cost_at([0.1], [1.0], 0.1)


def test_a_fine_solution_is_averaged_over_cells_and_read_at_points():
    fine = Lattice((0, 8), (0, 4), 0.1)
    x, y = fine.coordinates
    # means of a linear depth over cells inside are its values at their centroids
    expected = fine_solution(fine, 1 + x + 2 * y, np.full(fine.shape, 3.0))
    coarse, cloud = Lattice((0.5, 7.5), (0.5, 3.5), 0.5), random_points((0.5, 7.5), (0.5, 3.5), 60, 1)
    for points, scheme, error in (
        (coarse, WeightedResidual(), 1e-12),
        (coarse, Collocation(), 1e-12),
        (cloud, Collocation(), 1e-12),
    ):
        depth, momentum = expected(points, scheme)
        along, across = points.coordinates
        np.testing.assert_allclose(depth, 1 + along + 2 * across, rtol=error)
        np.testing.assert_allclose(momentum, 3 * depth, rtol=1e-12)


def test_means_of_a_fine_solution_over_voronoi_cells_come_closer_with_its_spacing():
    cloud = random_points((0, 8), (0, 4), 60, 1)
    wanted = 1 + cloud.control_volumes.centroid @ [1, 2]
    apart = []
    for spacing in (0.1, 0.025):
        fine = Lattice((0, 8), (0, 4), spacing)
        x, y = fine.coordinates
        found, _ = fine_solution(fine, 1 + x + 2 * y, 0 * x)(cloud, WeightedResidual())
        apart.append(np.abs(found - wanted).max())
    assert apart[1] < 0.4 * apart[0]
    assert apart[1] < 0.03


def test_coarse_cells_are_covered_by_fine_ones_once():
    part = overlap(np.linspace(0, 4, 33), 0.125, np.linspace(0.5, 3.5, 7), 0.5)
    np.testing.assert_allclose(part.sum(axis=1), 1, rtol=1e-14)
    # half of a cell of each end lies in a coarse cell whose sides are fine points
    assert sorted(set(np.round(part[2], 12))) == [0, 0.125, 0.25]


def test_a_cloud_as_fine_as_the_solution_is_refused():
    lattice = Lattice((0, 4), (0, 4), 1.0)
    expected = fine_solution(lattice, np.ones(lattice.shape), np.ones(lattice.shape))
    with pytest.raises(ValueError, match="as fine as"):
        expected(random_points((0, 4), (0, 4), 100, 1), WeightedResidual())


def test_a_case_without_a_solution_is_not_compared():
    with pytest.raises(ValueError, match="no solution"):
        measure(cap(25.0), Lattice((-150, 300), (-150, 150), 50.0))


def test_sections_come_to_their_marks_and_unknown_ones_are_refused():
    report = "A machine.\n\n## One\n\n| a |\n\n## Two\n\n| b |\n"
    page = "Text.\n<!-- bench: Two -->\nold\n<!-- end -->\nMore.\n<!-- bench: Machine -->\n<!-- end -->\n"
    filled = bench.insert(report, page)
    assert filled == (
        "Text.\n<!-- bench: Two -->\n| b |\n<!-- end -->\n"
        "More.\n<!-- bench: Machine -->\nA machine.\n<!-- end -->\n"
    )
    assert bench.insert(report, filled) == filled
    with pytest.raises(ValueError, match="no section Three"):
        bench.insert(report, "<!-- bench: Three -->\n<!-- end -->")


@pytest.mark.parametrize("name", ["performance.md", "performance-details.md"])
def test_the_tables_of_the_page_are_those_of_the_report(name):
    docs = ROOT / "docs"
    page = (docs / name).read_text(encoding="utf-8")
    assert bench.insert((docs / "bench" / "bench.md").read_text(encoding="utf-8"), page) == page
