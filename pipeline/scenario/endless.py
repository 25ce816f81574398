"""Flows that no domain can be found for: on beds steeper than friction everywhere, for a long time."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from pipeline.scenario import solver_objects
from pipeline.settings.settings import Settings
from solver.physics.terrain import Bend, Segments, SlopeProfile
from solver.release.shapes import Hemisphere, Release

# points on the way of a flow, as wide as its release, for which a domain is not looked for
MOST_POINTS = 200_000
# a film below this part of the release's depth counts as no flow, as by default of output.threshold
THINNEST = 0.01
_PLACES = 2000
_FAR = 1e7


def reach(settings: Settings, slope: SlopeProfile) -> float | None:
    """Give the distance that a flow travels at least until ``time.end``, m, if a domain cannot hold it.

    It is known where the bed is steeper than friction everywhere beyond the release: Coulomb friction leaves
    at least a constant acceleration, drag at least the speed at which a film is in equilibrium.

    Returns
    -------
    float or None
        None where the flow may come to rest, or ends soon enough by its time.
    """
    releases = solver_objects.releases(settings)
    x0, x1, y0, y1 = np.array([release.extent for release in releases]).T
    start, stop, width = float(x0.min()), float(x1.max()), float(y1.max() - y0.min())
    inclination = _least(slope, start, stop, _ends(slope))
    friction, _ = solver_objects.laws(settings)
    # at unit normal load
    driving = float(np.sin(inclination) - np.cos(inclination) * friction.least_coefficient)
    if driving <= 0:
        return None
    end = float(getattr(settings.time, "end", None) or np.inf)
    depth = settings.output.threshold or THINNEST * max(map(_height, releases))
    speed = friction.film_speed(depth, driving)
    # a zone may stop it
    if speed == 0 or settings.zones:
        return None
    found = min(0.5 * settings.gravity * driving * end**2, end * speed)
    spacing = getattr(settings.points, "spacing", None)
    if spacing is None:
        return None
    return float(found) if found * width > MOST_POINTS * spacing**2 else None


@lru_cache(maxsize=1024)
def _least(slope: SlopeProfile, start: float, stop: float, ends: tuple[float, ...]) -> float:
    """Least inclination beyond a release in the direction in which the bed falls under it, rad."""
    way = 1 if float(slope.inclination((start + stop) / 2)) >= 0 else -1
    span = 2 * max(stop - start, *map(abs, (start, stop, *ends)))
    beyond = np.append(np.linspace(0, span, _PLACES), _FAR)
    return float((way * slope.inclination((start if way > 0 else stop) + way * beyond)).min())


def _ends(slope: SlopeProfile) -> tuple[float, ...]:
    """Places beyond which a profile is straight, m."""
    if isinstance(slope, Bend):
        return slope.start, slope.end
    if isinstance(slope, Segments):
        return tuple(start + slope.joint for start in slope.starts)
    return (float(getattr(slope, "length", 0.0)),)


def _height(release: Release) -> float:
    """Depth of a release before it is scaled, m."""
    return float(release.radius if isinstance(release, Hemisphere) else getattr(release, "height"))  # noqa: B009
