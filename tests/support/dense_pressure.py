"""The earth pressure of a cell in plain NumPy, to compare kernels with."""

import numpy as np


def earth_pressure(law, along, across, fall, normal, rises):
    """beta and half the speed of the waves of the state, both along and across."""
    x_a, x_p, y_aa, y_ap, y_pa, y_pp = law.coefficients()
    rest, steepness, coupling = law.transition()

    def share(rate, steepness):
        return np.clip(rest - steepness * fall * rate, 0, 1)

    s, t, felt = share(along, steepness), share(across, steepness), share(along, coupling * steepness)
    active, passive = y_aa + felt * (y_pa - y_aa), y_ap + felt * (y_pp - y_ap)
    spans = x_p - x_a, passive - active
    beta = normal * (x_a + s * spans[0]), normal * (active + t * spans[1])
    waves = [
        np.where((part > 0) & (part < 1), normal * np.minimum(rise, 1) * span * steepness * fall / 2, 0)
        for part, span, rise in zip((s, t), spans, rises, strict=True)
    ]
    return *beta, *waves


def stretching(mean, half, rise):
    """Rate of stretching toward the deeper side."""
    return mean + np.clip(rise / 0.05, -1, 1) * half
