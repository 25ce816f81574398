"""The weighted-residual form on a cloud of points."""
