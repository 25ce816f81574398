"""The weighted-residual form on a surface: lattice cells in plan, lifted on to an elevation model."""
