"""The chute converges under refinement with Mohr-Coulomb earth pressure."""

from dataclasses import replace

import pytest

from pipeline.studies.convergence import falls, heap, ladder, lattice, long_heap, row
from solver.physics.earth_pressure import MohrCoulomb, MohrCoulombFlow
from solver.simulation import simulate


@pytest.mark.parametrize(("law", "last"), [(MohrCoulomb, 0.022), (MohrCoulombFlow, 0.025)])
@pytest.mark.parametrize("phi", [30.0, 40.0])
def test_the_chute_converges_in_two_dimensions(phi, law, last):
    runs, differences = ladder(lattice, heap, law(phi, 30.0), (0.4, 0.2, 0.1, 0.05))
    least, growth = falls(differences)
    assert least >= 1.6
    assert growth <= 1.1
    assert differences[-1, -1] < last
    assert all(abs(run.ledger.error) < 1e-13 for _, run in runs)


def test_the_chute_converges_in_one_dimension_where_the_bare_sign_does_not():
    spacings = (0.1, 0.05, 0.025, 0.0125, 0.00625)
    smooth, bare = (
        falls(ladder(row, long_heap, MohrCoulomb(40.0, 30.0, **given), spacings)[1])
        for given in ({}, {"pressure_transition": 0.0})
    )
    assert smooth[0] >= 1.6
    assert smooth[1] <= 1.1
    assert bare[0] < 1.6


def test_the_step_is_shorter_where_the_state_moves_waves():
    scene = replace(heap(lattice(0.4)), earth_pressure=MohrCoulomb(40.0, 30.0, pressure_transition=0.1))
    wide = replace(scene, earth_pressure=MohrCoulomb(40.0, 30.0, pressure_transition=5.0))
    assert simulate(scene, [6.0]).steps > 1.1 * simulate(wide, [6.0]).steps
