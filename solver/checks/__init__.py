"""Laws that a run must keep, and signs that its result is doubtful."""
