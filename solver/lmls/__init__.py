"""Local moving least squares: shape functions on a support, and fields brought from a cloud to a lattice."""
