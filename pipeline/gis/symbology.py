"""How maps look: the classes of each quantity, with their edges, colours and words.

Pictures, rasters, vector layers, the QGIS project and the page all take them from here. A new quantity is
declared by one line of `SCALES`, new classes by one of `CLASSES`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_hex
from matplotlib.ticker import MaxNLocator

from pipeline.readable import written

# no grey, which is what a hillshade is of
UNKNOWN_COLOUR = "#d9a0e8"
UNKNOWN_WORDS = "not computed"
# with fewer classes below the largest value a scale says nothing, as on a model in a laboratory
LEAST_CLASSES = 3
STEPS = (1.0, 2.0, 5.0)
MOST_STEPS = 8


@dataclass(frozen=True)
class Entry:
    """One class of a legend: values above `lower` up to `upper`, or the whole number that both are."""

    lower: float
    upper: float
    colour: str
    label: str


@dataclass(frozen=True)
class Style:
    """The legend of a map.

    Parameters
    ----------
    caption : str
        What its values are, with their unit.
    entries : tuple of Entry
        Ascending, without gaps.
    discrete : bool
        Whether the values are whole numbers, each a class of its own, 0 being none.
    """

    caption: str
    entries: tuple[Entry, ...]
    discrete: bool = False

    @property
    def edges(self) -> list[float]:
        """Lower edges of all entries, then the upper edge of the last, which may be infinite."""
        return [*(each.lower for each in self.entries), self.entries[-1].upper]


@dataclass(frozen=True)
class Scale:
    """Edges and colours of a quantity.

    Parameters
    ----------
    edges : tuple of float
        Ascending; what is not above the first one is not shown.
    colours : str
        A colour map of Matplotlib.
    closed : bool
        Whether nothing lies above the last edge.
    caption : str
        What stands at the legend.
    """

    caption: str
    edges: tuple[float, ...]
    colours: str
    closed: bool = False


SCALES = {
    # what a few runs of a hundred do can be told from nothing
    "share": Scale("share", (0.0, 0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0), "YlOrRd", closed=True),
    "rate": Scale("events a year", (0.0, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0), "YlOrRd"),
    # thin films are shown, but pale
    "depth": Scale("depth", (0.01, 0.1, 0.25, 0.5, 1.0, 2.0, 5.0), "YlGnBu"),
    "erosion_depth": Scale("depth of erosion", (0.01, 0.1, 0.25, 0.5, 1.0, 2.0), "YlOrBr"),
    "speed": Scale("speed", (0.1, 1.0, 2.0, 5.0, 10.0, 20.0, 40.0), "PuRd"),
    "momentum_flux": Scale("momentum flux", (0.1, 1.0, 5.0, 10.0, 50.0, 100.0, 500.0), "BuPu"),
    "pressure": Scale("dynamic pressure", (1.0, 3.0, 10.0, 30.0, 100.0, 300.0), "OrRd"),
}
# what grows and falls, coloured as differences are
CHANGES = {"bed_change": "change of the ground's elevation"}
TIMES = "viridis_r"
OTHERS, DIFFERENCES = "YlGnBu", "RdBu_r"


@dataclass(frozen=True)
class Class:
    """A class of a map of whole numbers, by its word and its colour; `plain` is the name of the colour."""

    word: str
    colour: str
    plain: str = ""


# 0 is none of them; the colours of levels are those of the Swiss hazard maps
CLASSES: dict[str, tuple[Class, ...]] = {
    "intensity": (
        Class("weak", "#c7e9b4"),
        Class("medium", "#41b6c4"),
        Class("strong", "#225ea8"),
    ),
    "hazard_level": (
        Class("residual", "#fdf6c3", "yellow and white"),
        Class("low", "#fee45c", "yellow"),
        Class("medium", "#4f8fcc", "blue"),
        Class("high", "#d7352b", "red"),
    ),
}


def of_classes(name: str, caption: str) -> Style:
    """Give the legend of a map of classes by the name that `CLASSES` has for them."""
    entries = []
    for value, each in enumerate(CLASSES[name], 1):
        label = f"{each.word} ({each.plain})" if each.plain else each.word
        entries.append(Entry(value, value, each.colour, label))
    return Style(caption, tuple(entries), discrete=True)


def of_values(name: str, units: str, largest: float, smallest: float = 0.0) -> Style:
    """Give the legend of a map of numbers.

    Parameters
    ----------
    name : str
        Of the quantity: one of `SCALES`, ``time``, or another one, which gets even steps.
    units : str
        Of the values; ``1`` and ``year-1`` are not written.
    largest, smallest : float
        Of all values of the map and of those it is compared with.
    """
    scale = SCALES.get(name)
    if name == "time":
        scale = _arrivals(largest)
    elif scale is None:
        scale = _even(name, largest, smallest)
    elif not scale.closed and largest > 0 and sum(edge < largest for edge in scale.edges) < LEAST_CLASSES:
        scale = Scale(scale.caption, _ladder(largest, len(scale.edges)), scale.colours)
    unit = "" if units in ("1", "year-1", "") else f" ({written(units)})"
    return Style(f"{scale.caption}{unit}", _entries(scale))


def of_differences(name: str, units: str, reach: float) -> Style:
    """Give the legend of a map of differences, as many classes above 0 as below it.

    Parameters
    ----------
    name : str
        Of the quantity that differs.
    units : str
        Of the values; those of shares have the classes of shares.
    reach : float
        Largest size of a difference.
    """
    caption = CHANGES.get(name) or f"difference, {name.replace('_', ' ')}"
    if units == "1":
        above = SCALES["share"].edges[1:]
        edges = (*(-edge for edge in reversed(above)), *above)
    else:
        edges = _even(name, reach or 1.0, -(reach or 1.0)).edges
    unit = "" if units in ("1", "year-1", "") else f" ({written(units)})"
    return Style(f"{caption}{unit}", _entries(Scale(caption, edges, DIFFERENCES, closed=True)))


def _even(name: str, largest: float, smallest: float) -> Scale:
    """Make even steps: from 0, or to both sides of it where there are values below."""
    caption = name.replace("_", " ")
    if smallest < 0:
        reach = max(largest, -smallest)
        steps = MaxNLocator(MOST_STEPS, symmetric=True).tick_values(-reach, reach)
        return Scale(caption, tuple(float(step) for step in steps), DIFFERENCES, closed=True)
    steps = MaxNLocator(MOST_STEPS, min_n_ticks=5).tick_values(0, largest if largest > 0 else 1.0)
    return Scale(caption, tuple(float(step) for step in steps), OTHERS, closed=True)


def _arrivals(largest: float) -> Scale:
    """Make steps of time that double: most of a place is reached early, and its edges much later."""
    largest = largest if largest > 0 else 1.0
    steps = _ladder(10 * largest, MOST_STEPS + 3)
    last = next(i for i, step in enumerate(steps) if step >= largest * (1 - 1e-6))
    return Scale("time", (0.0, *steps[max(0, last - MOST_STEPS + 1) : last + 1]), TIMES, closed=True)


def _ladder(largest: float, count: int) -> tuple[float, ...]:
    """Give the last 1, 2 and 5 times powers of ten below a number, ascending."""
    power = np.floor(np.log10(max(largest, 1e-12)))
    steps = [step * 10.0**at for at in np.arange(power - count, power + 1) for step in STEPS]
    # ten to a negative power is off by round-off
    below = [float(f"{step:.6g}") for step in steps if step < largest]
    return tuple(below[-count:])


def _entries(scale: Scale) -> tuple[Entry, ...]:
    edges: Sequence[float] = scale.edges if scale.closed else (*scale.edges, np.inf)
    count = len(edges) - 1
    # the palest colours cannot be told from paper
    shades = np.linspace(0.02, 0.98, count) if scale.colours == DIFFERENCES else np.linspace(0.12, 1.0, count)
    colours = [to_hex(colormaps[scale.colours](shade)) for shade in shades]
    found = []
    for low, high, colour in zip(edges[:-1], edges[1:], colours, strict=True):
        label = f"above {low:g}" if np.isinf(high) else f"{low:g} to {high:g}"
        found.append(Entry(low, high, colour, label))
    return tuple(found)
