"""Campaigns in pieces: kept, joined, drawn from the code; and a small one of the seed of this very state."""

import json
import subprocess

import pytest
from root import ROOT
from scipy.stats import binom

from pipeline.studies.stress import pieces, report
from pipeline.studies.stress.campaign import Row, ending, perform, same_with_any_workers
from pipeline.studies.stress.pieces import Plan, code, filled, in_pieces, seeds_of
from pipeline.studies.stress.records import record_of, row_of
from pipeline.studies.stress.scenes import can_be_run, draw
from pipeline.studies.stress.watch import ENDS, Watched

SMALL, OWN_SCENES = 1e5, 6
# laws that no scene may break
ALWAYS = {
    *("values are finite", "depth is not negative", "ledger of volume", "a restart changes nothing"),
    *("no more is taken up than there is", ENDS),
}
# share of scenes that break another law, at most: the bound of docs/stability.md
KNOWN_RATE = 0.02


@pytest.fixture
def counted(monkeypatch):
    """Draw scenes, three a piece, and count those that would be run."""
    ran = []

    def campaign(todo, workers, tell, work):
        ran.extend(drawn.name for drawn, _ in todo)
        numbers = [int(drawn.name.rpartition("-")[2]) for drawn, _ in todo]
        return [
            Row(drawn, Watched(points=1 + number, steps=5, time=1.0))
            for number, (drawn, _) in zip(numbers, todo, strict=True)
        ]

    monkeypatch.setattr(pieces, "campaign", campaign)
    monkeypatch.setattr(pieces, "same_with_any_workers", lambda *given: None)
    monkeypatch.setattr(pieces, "PIECE", 3)
    return ran


def test_a_campaign_that_was_cut_off_goes_on_where_it_was(counted, tmp_path, monkeypatch):
    plan, silent = Plan([3, 4], 9, SMALL, 1), lambda text: None
    rows, seconds = in_pieces(plan, tmp_path, silent)
    assert counted == [row.drawn.name for row in rows]
    assert counted == [f"stress-3-{k}" for k in range(5)] + [f"stress-4-{k}" for k in range(4)]
    kept = sorted((tmp_path / "pieces").iterdir())
    assert len(kept) == 4
    kept[1].unlink()
    counted.clear()
    again, _ = in_pieces(plan, tmp_path, silent)
    assert counted == ["stress-3-3", "stress-3-4"]
    told = report.Told(plan.seeds, "", SMALL, 1, seconds)
    assert [record_of(row) | {"watched": 0} for row in again] == [
        record_of(row) | {"watched": 0} for row in rows
    ]
    assert report.rate(again) == report.rate(rows)
    one, two = (list(report.tables(r, told, "##")) for r in (rows, again))
    assert [line for line in one if "seconds" not in line] == [line for line in two if "seconds" not in line]
    # another state of the code
    monkeypatch.setattr(pieces, "code", lambda: "other")
    counted.clear()
    in_pieces(plan, tmp_path, silent)
    assert len(counted) == 9


def test_a_campaign_of_scenes_with_some_sections_repeats_all(counted, tmp_path, monkeypatch):
    repeated = []
    run = pieces.campaign
    monkeypatch.setattr(
        pieces, "campaign", lambda todo, *rest: repeated.extend(flag for _, flag in todo) or run(todo, *rest)
    )
    plan = Plan([3], 4, SMALL, 1, ("erodible_bed", "inflow"))
    rows, _ = in_pieces(plan, tmp_path, lambda text: None)
    assert counted == [row.drawn.name for row in rows]
    with_both = [draw(3, k) for k in range(100)]
    with_both = [each.name for each in with_both if {"erodible_bed", "inflow"} <= each.data.keys()]
    assert counted[: len(with_both)] == with_both[:4]
    assert all({"erodible_bed", "inflow"} <= row.drawn.data.keys() for row in rows)
    assert repeated == [True] * 4
    # what is kept of all scenes is not taken for it
    counted.clear()
    in_pieces(Plan([3], 1, SMALL, 1), tmp_path, lambda text: None)
    assert counted == ["stress-3-0"]


def test_a_row_is_what_its_record_says(tmp_path):
    row = perform(draw(1, 3), False, 1e4)
    row.file = tmp_path / "scene.yaml"
    again = row_of(json.loads(json.dumps(record_of(row))), draw(1, 3), tmp_path)
    assert again.watched == row.watched
    assert (again.broken, again.reason, again.file) == (row.broken, row.reason, row.file)
    refused = Row(draw(1, 4), reason="no error: ZeroDivisionError")
    assert row_of(json.loads(json.dumps(record_of(refused))), draw(1, 4), tmp_path) == refused


def test_seeds_hang_on_all_of_the_code():
    assert len(set(seeds_of(code()))) == 5
    assert seeds_of("one") == seeds_of("one") != seeds_of("two")


def test_tables_go_between_the_marks_of_a_page():
    page = (ROOT / "docs" / "stability.md").read_text(encoding="utf-8")
    assert "| tables |" in filled(page, "| tables |")
    with pytest.raises(ValueError, match="marks"):
        filled("no marks", "| tables |")


def own_seed() -> int:
    """Seed of the commit, or of the code where there is no git."""
    try:
        call = ["git", "-C", str(ROOT), "rev-parse", "HEAD"]
        state = subprocess.run(call, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        state = code()
    return seeds_of(state, 1)[0]


def test_scenes_that_nobody_has_seen_keep_the_laws():
    seed = own_seed()
    rows = [perform(draw(seed, k), False, SMALL) for k in range(OWN_SCENES)]
    judged = [row for row in rows if row.conservative and row.watched is not None]
    assert len(judged) > OWN_SCENES / 2
    broken = {row.drawn.name: row.broken for row in judged if row.broken}
    how = f"pipeline stress --seed {seed} --scenes {OWN_SCENES} --work {SMALL:g}"
    told = f"{broken}; {how} does it again"
    assert not any(law in ALWAYS for laws in broken.values() for law in laws), told
    # the rate of docs/stability.md would hardly ever break so many
    assert binom.sf(len(broken) - 1, len(judged), KNOWN_RATE) > 1e-3, told


def test_a_scene_that_ended_before_its_hydrograph_began_is_not_run_again(tmp_path):
    drawn = next(
        each
        for each in (draw(59145787, k) for k in range(158, 300))
        if "inflow" in each.data and not can_be_run(ending(each, 1e-6))
    )
    row = Row(drawn, Watched(points=1, time=1e-6), repeated=True)
    same_with_any_workers([row], tmp_path)
    assert row.repeats == []
    assert not (tmp_path / "repeated").exists()
