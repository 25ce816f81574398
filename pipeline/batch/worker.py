"""What a worker process loads before its first task: the solver."""

import pipeline.batch.task  # noqa: F401
import solver.simulation  # noqa: F401
