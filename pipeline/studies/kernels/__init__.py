"""What the kernels of a stage cost, each alone."""
