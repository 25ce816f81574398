"""The weighted-residual form on a lattice."""
