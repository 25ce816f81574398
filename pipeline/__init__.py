"""Scenario files, batches of runs, stores, assessment, maps and reports."""
