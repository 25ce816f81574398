"""Compiled kernels that the lattice, the cloud and the collocation form share."""
