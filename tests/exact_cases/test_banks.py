"""Layers between banks: volume is exact, and what creeps does so less on finer lattices."""

from solver.verification.bank_cases import in_gully, pond


def test_a_pond_in_a_basin_keeps_its_volume():
    assert abs(pond(4.0, end=100.0).ledger.error) < 1e-14


def test_a_deposit_in_a_gully_creeps_less_far_on_a_finer_lattice():
    coarse, fine = in_gully(8.0), in_gully(4.0)
    assert fine.front < coarse.front - 50
    assert fine.centroid < 0.6 * coarse.centroid
