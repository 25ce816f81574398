"""Where the flow is computed: lattices and clouds of points, and their control volumes."""
