"""The functions that scripts, notebooks and the command line call, a module each subject.

Modules that take long to import (Numba, xarray, Dask) are imported inside the functions that need them.
"""
