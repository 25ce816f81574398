"""What a worker process loads before its first task: the solver, and deafness to Ctrl-C."""

from __future__ import annotations

import signal

import pipeline.task  # noqa: F401
import solver.simulation  # noqa: F401

# Ctrl-C reaches the whole process group, and the driver alone decides what stops.
signal.signal(signal.SIGINT, signal.SIG_IGN)
