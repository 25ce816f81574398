import pytest

from solver.warmup import KINDS, compile_kernels, not_compiled


@pytest.mark.parametrize("kind", KINDS)
def test_the_loop_over_time_steps_is_kept_on_disk(kind):
    compile_kernels([kind])
    assert not_compiled([kind]) == []
