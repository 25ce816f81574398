"""Where forms break and what results depend on: the search on scenes that are known, and the tables."""

from dataclasses import replace

import numpy as np
import pytest
from root import ROOT

from pipeline.studies import stability as study
from pipeline.studies.stability import Stiff, Unswitched, breaking, doubling, ends, limit
from solver.physics.earth_pressure import MohrCoulomb
from solver.scene import Collocation, WeightedResidual
from solver.simulation import simulate
from solver.verification.cases import cap, dam_break

PAGE = ROOT / "docs" / "stability.md"
CAP = cap()
SCENE = CAP.scene(CAP.lattice(8.0), WeightedResidual())


def test_the_limit_is_bisected_to_a_hundredth():
    found, how = limit(SCENE, lambda scene: "too long" if scene.scheme.cfl > 3.21 else "")
    assert 3.21 < found < 1.01 * 3.21
    assert how == "too long"
    assert np.isnan(limit(SCENE, lambda scene: "")[0])


def test_errors_double_before_a_law_breaks():
    error, how = limit(SCENE, doubling(CAP, SCENE))
    law, which = limit(SCENE, breaking(CAP, SCENE))
    assert 0.9 < error < law
    assert how == "error"
    assert which
    assert not breaking(CAP, SCENE)(SCENE)


def test_what_the_collocation_form_breaks_is_that_it_ends_early():
    case = replace(CAP, time=20.0)
    loose = case.scene(case.lattice(20.0), Collocation(relaxation=0.0, film=0.0, cfl=6.0))
    assert simulate(loose, [20.0]).failure is not None
    assert breaking(case, loose)(loose) == "the run goes on to its end"


def test_a_profile_ends_where_it_crosses_the_depth():
    places = np.arange(6.0)
    assert ends(places, np.array([0, 0, 2.0, 3.0, 1.0, 0]), 0.5) == pytest.approx((1.25, 4.5))


def test_earth_pressure_that_is_not_switched_has_one_coefficient_each_way():
    switched = MohrCoulomb(35.0, 25.0).coefficients()
    active, passive = (kind(35.0, 25.0).coefficients() for kind in (Unswitched, Stiff))
    assert set(active) == {switched.x_active, switched.y_active_active}
    assert set(passive) == {switched.x_passive, switched.y_passive_passive}


def test_the_tables_have_a_line_a_choice_and_the_page_holds_them_all(monkeypatch):
    monkeypatch.setattr(study, "CASES", {})
    monkeypatch.setattr(study, "SPACINGS", {"chute": (1.0, 0.8), study.FED: (4.0, 2.0)})
    monkeypatch.setattr(study, "COURANT", (0.9, 1.2))
    monkeypatch.setattr(study, "WET", (1e-3,))
    monkeypatch.setattr(study, "PRESSURES", {"phi 40": MohrCoulomb(40.0, 30.0)})
    lines = list(study.report())
    for title, count in (("Courant numbers", 2), ("Deposit of the chute", 7), ("Front of a dam break", 6)):
        first = lines.index(f"## {title}") + 2
        table = lines[first:].index("") if "" in lines[first:] else len(lines) - first
        assert table == count
        assert len({line.count("|") for line in lines[first : first + table]}) == 1
        assert f"<!-- bench: {title} -->\n|" in PAGE.read_text(encoding="utf-8")


def test_the_front_of_a_dam_break_comes_nearer_to_the_exact_one():
    case = dam_break()
    far, near = (
        float(study.fed_front(case.scene(case.lattice(spacing), WeightedResidual()), spacing)[0])
        for spacing in (2.0, 1.0)
    )
    assert far < near < 0
