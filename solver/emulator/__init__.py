"""Gaussian-process emulators of runs: probabilities and quantiles of many draws from few runs.

Arrays in, arrays out. The package knows no files, no scenarios and no stores.
"""
