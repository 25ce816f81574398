"""The collocation form of the paper (eqs. 12-25), on a lattice or a cloud."""
