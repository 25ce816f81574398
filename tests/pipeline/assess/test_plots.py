import pytest
from synthetic import store

from pipeline.assess.plots import title_of
from pipeline.store.variables import Status


@pytest.mark.parametrize(
    ("status", "title"),
    [
        (Status.DONE, "synthetic: bed friction 20"),
        (Status.CUT_OFF, "synthetic: bed friction 20 (cut off)"),
        (Status.OVERRUN, "synthetic: bed friction 20 (done but overrun)"),
        (Status.OVERRUN_AND_CUT_OFF, "synthetic: bed friction 20 (overrun and cut off)"),
        (Status.FAILED, "synthetic: bed friction 20 (failed)"),
    ],
)
def test_titles_say_of_a_run_that_is_not_done_what_became_of_it(status, title):
    assert title_of(store({"bed_friction": [25.0, 20.0]}, status=[Status.DONE, status]), 1) == title
