"""A batch of runs: driver, scheduling on worker processes, limits, checkpoints and failures."""
