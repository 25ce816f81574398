import numpy as np
import pytest

from solver.kernels.source_terms import component, velocity_left


def test_a_velocity_next_to_nothing_beside_the_other_component_or_the_waves_is_none():
    assert component(1e-59, -1.0) == 1e-59
    assert component(-1e-61, 1.0) == component(0.0, 0.0) == 0.0
    h, normal = 0.01, 9.81
    for unit in (1.0, 1e-30):
        wave = np.sqrt(normal * unit * h)
        for share, left in ((1e-59, 1.0), (1e-61, 0.0)):
            hu = share * wave * unit * h
            per_depth = velocity_left(hu, 0.0, unit * h, 0.0, normal, 0.0)
            assert per_depth * hu == pytest.approx(left * share * wave, rel=1e-12, abs=0.0)
