from dataclasses import replace

import numpy as np
import pytest

from solver.physics.friction import Coulomb
from solver.verification.cases import CONSERVATIVE, cap, relative_errors
from solver.verification.exact_cases import order
from solver.verification.plain_scheme import plain_run

SPACINGS = (8.0, 4.0, 2.0)


@pytest.fixture(scope="module")
def ladder():
    case = cap()
    scenes = [case.scene(case.lattice(spacing), CONSERVATIVE) for spacing in SPACINGS]
    return case, scenes, [plain_run(scene, case.time) for scene in scenes]


def test_errors_of_the_plain_scheme_fall_at_its_order_to_its_size(ladder):
    case, scenes, runs = ladder
    errors = [
        relative_errors(case, scene, run.depth, run.momentum_x)
        for scene, run in zip(scenes, runs, strict=True)
    ]
    for found, limit, least in zip(
        zip(*errors, strict=True), (4.6e-3, 4.5e-3, 2.3e-3), (1.2, 1.2, 1.6), strict=True
    ):
        assert found[-1] <= limit
        assert order(list(found), SPACINGS) >= least


def test_its_volume_is_exact_and_its_depth_never_negative(ladder):
    _, scenes, runs = ladder
    for scene, run in zip(scenes, runs, strict=True):
        assert run.depth.sum() == pytest.approx(scene.depth.sum(), rel=1e-14)
        assert run.depth.min() >= 0
        assert run.cpu_time > 0
        # what is dry is not stepped
        assert run.cell_stages < 0.6 * 3 * run.steps * run.depth.size


def test_it_keeps_the_mirror_image_and_moves_down_the_slope_alone(ladder):
    *_, runs = ladder
    for run in runs:
        np.testing.assert_allclose(run.depth, run.depth[::-1], atol=1e-12)
        np.testing.assert_allclose(run.momentum_y, -run.momentum_y[::-1], atol=1e-11)
        assert run.momentum_x.min() >= 0


def test_it_refuses_what_it_has_no_terms_for(ladder):
    case, scenes, _ = ladder
    rough = replace(scenes[0], friction=Coulomb(25.0))
    moving = replace(scenes[0], velocity_x=np.ones(scenes[0].points.shape))
    for scene in (rough, moving):
        with pytest.raises(ValueError, match="frictionless"):
            plain_run(scene, case.time)
