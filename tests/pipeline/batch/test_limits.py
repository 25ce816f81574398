import subprocess
import sys

# arrays of the size of those of a run, made and freed again and again, and the pages that had to be asked for
SOURCE = """
import resource, sys
import numpy as np
from pipeline.batch.limits import keep_freed_memory

if sys.argv[1] == "kept":
    keep_freed_memory()

def faults():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(10):
        arrays = [np.ones(250_000) for _ in range(10)]
        del arrays
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

faults()
print(faults())
"""


def pages_asked_for(memory):
    command = [sys.executable, "-c", SOURCE, memory]
    return int(subprocess.run(command, capture_output=True, text=True, check=True, timeout=120).stdout)


def test_what_runs_free_is_kept_for_the_next_one():
    assert pages_asked_for("kept") < 0.01 * pages_asked_for("given back")
