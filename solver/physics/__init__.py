"""The equations' closures: terrain, earth pressure and basal friction, with no numerics."""
