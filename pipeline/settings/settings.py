"""Settings of a scenario: every key, with its unit, default and limits."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, floor, log10, prod, sqrt
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias, get_args

from pydantic import Discriminator, Field, PrivateAttr, Tag, model_validator

from pipeline.settings import erodible_bed
from pipeline.settings import inflow as inflow_settings
from pipeline.settings.erodible_bed import ErodibleBed
from pipeline.settings.generated import FlatSection, tag
from pipeline.settings.hazard import USUAL_DENSITY, Georeference, Hazard
from pipeline.settings.inflow import Inflow, MeasuredSection
from pipeline.settings.physics import DEFAULT_SCHEME, AnyRelease, AnyScheme, AnyTerrain, Material
from pipeline.settings.points import LatticePoints, Points, Region
from pipeline.settings.receptor import LayerOfReceptors, Receptor
from pipeline.settings.report import Report
from pipeline.settings.sample import Sample, Scalar
from pipeline.settings.section import Positive, Section, key, relation
from pipeline.settings.structures import AnyStructure
from pipeline.settings.structures import unfit as unfit_structures
from pipeline.settings.surface import ElevationTerrain, unfit
from pipeline.settings.zones import Zone, ZoneKeys
from solver.physics.constants import GRAVITY
from solver.physics.friction import Coulomb
from solver.scheme import Collocation

FieldName = Literal[
    "depth", "velocity_x", "velocity_y", "max_depth", "max_speed", "max_momentum_flux", "arrival_time",
    "deposit_depth", "erosion_depth", "bed_change",
]  # fmt: skip
MOST_FRAMES, MOST_SAMPLES = 100_000, 1_000_000
FIELDS: tuple[FieldName, ...] = get_args(FieldName)


class Domain(Region):
    """Bounds of the points; a lattice has points on them, and its cells reach half a spacing farther."""


class GivenDepth(Section):
    """A side where the depth is given."""

    depth: Annotated[float, Field(ge=0)] = key("depth held at the side", "m")


def _kind_of_side(value: Any) -> str:
    return "given" if isinstance(value, dict | GivenDepth) else "kind"


KindOfSide = Literal["open", "wall", "no-slip"]
Side = Annotated[
    Annotated[KindOfSide, Tag("kind")] | Annotated[GivenDepth, Tag("given")],
    Discriminator(_kind_of_side),
]


class Boundaries(Section):
    """What stands at each side."""

    x_min: Side = key(
        "upslope side",
        default="open",
        choices={
            "open": "lets material leave",
            "wall": "no flow through it, free slip along it",
            "no-slip": "no flow through it nor along it",
            "{depth: value}": "holds a depth, m",
        },
        advice="Leave sides open where the flow should not reach them; what leaves is counted.",
    )
    x_max: Side = key("downslope side, likewise", default="open")
    y_min: Side = key("side of lowest y, likewise", default="open")
    y_max: Side = key("side of highest y, likewise", default="open")


class Time(Section):
    """How long, and how often frames are kept."""

    end: Positive | None = key(
        "time to stop at. Default: once everything is at rest, at the latest 200 sqrt(L/g), L the longer "
        "side of the domain and g gravity, after the last of what comes in",
        "s",
        None,
        advice="Leave it out where results are assessed: what still moves at the end is told as cut off.",
    )
    output_every: Positive | None = key(
        "time between frames, from 0; the end always is one. Default: a tenth of `end`; without one ten of "
        "2 sqrt(L/g)",
        "s",
        None,
        advice="Maxima, arrival and deposit do not depend on it.",
    )
    stop_at_rest: bool = key("whether a run ends once everything is at rest", default=True)
    max_steps: Annotated[int, Field(gt=0)] | None = key(
        "time steps after which a run fails; no change of the scenario", default=None
    )
    max_wall: Positive | None = key(
        "elapsed time of computing after which a run fails; no change of the scenario", "s", None
    )

    @model_validator(mode="after")
    def _within(self) -> Time:
        if self.end is None:
            if not self.stop_at_rest:
                raise relation("expected a time, as runs do not stop at rest", "end", "stop_at_rest")
            return self
        every = self.output_every or self.end
        if every > self.end:
            raise relation(f"expected at most end ({self.end:g}), found {every:g}", "output_every", "end")
        if self.end / every > MOST_FRAMES:
            found = f"expected at most {MOST_FRAMES:,} frames, found {self.end / every:.3g}"
            raise relation(found, "output_every", "end")
        return self


class Output(FlatSection):
    """What is kept."""

    # which scenarios without sections do not have
    alternatives = frozenset({"section_every"})
    fields: Annotated[tuple[FieldName, ...], Field(min_length=1)] = key(
        "fields kept in the store. Default: all; the last two with an erodible bed alone", default=FIELDS
    )
    threshold: Positive | None = key(
        "depth above which a cell counts as reached or as deposit. Default: 1 % of the largest depth that is "
        "released or comes in",
        "m",
        None,
        advice="Give it where runs of different volume are compared.",
    )
    section_every: Positive | None = key(
        "time between samples of discharge at sections, of which there are 1,000,000 at most. Default: a "
        "tenth of the time between frames",
        "s",
        None,
    )


def _one_or_many(value: Any) -> str:
    return "many" if isinstance(value, tuple | list) else "one"


OneOrMany = Annotated[
    Annotated[AnyRelease, Tag("one")] | Annotated[tuple[AnyRelease, ...], Field(min_length=1), Tag("many")],
    Discriminator(_one_or_many),
]

if TYPE_CHECKING:
    Inflows: TypeAlias = tuple[Inflow, ...]
else:
    Inflows = Annotated[
        Annotated[Inflow, Tag("one")] | Annotated[tuple[Inflow, ...], Tag("many")],
        Discriminator(_one_or_many),
    ]

_Several = Annotated[tuple[Positive, ...], Field(min_length=1)]


def _per_run_or_lists(value: Any) -> str:
    return "runs" if isinstance(value, tuple | list) else "lists"


# one a run, or one an entry of lists of the sweep
Numbers = Annotated[
    Annotated[_Several, Tag("runs")] | Annotated[dict[str, _Several], Tag("lists")],
    Discriminator(_per_run_or_lists),
]


def _one_or_several(value: Any) -> str:
    return "all" if isinstance(value, int | float) else _per_run_or_lists(value)


def _periods(value: Any) -> str:
    return "word" if isinstance(value, str) else _one_or_several(value)


OF_POLYGONS = "polygons"
MATERIAL_DENSITY = "material.density"
# one for all runs, or as above, or as polygons of releases say
Periods = Annotated[
    Annotated[Positive, Tag("all")]
    | Annotated[Literal["polygons"], Tag("word")]
    | Annotated[_Several, Tag("runs")]
    | Annotated[dict[str, _Several], Tag("lists")],
    Discriminator(_periods),
]


def _file_or_list(value: Any) -> str:
    if isinstance(value, LayerOfReceptors) or (isinstance(value, dict) and {"file", "layer"} & {*value}):
        return "layer"
    return "file" if isinstance(value, str) else "list"


Receptors = Annotated[
    Annotated[tuple[Receptor, ...], Tag("list")]
    | Annotated[str, Field(min_length=1), Tag("file")]
    | Annotated[LayerOfReceptors, Tag("layer")],
    Discriminator(_file_or_list),
]

# Latest end of runs that go on to rest, in times sqrt(L/g); Voellmy films creep for the longest of it.
LATEST = 200


OF_ALL_RUNS = {
    *("sweep", "sample", "weights", "return_periods", "receptors", "georeference", "hazard", "report"),
}


class Settings(Section):
    """A scenario: one or many runs that share points, output times and a store."""

    name: str = key(
        "name of the scenario and of its store: letters, digits, `-`, `_` and `.`, "
        "beginning with a letter or digit",
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$",
        max_length=100,
    )
    description: str = key("what the scenario is, in a line", default="")
    gravity: Positive = key("gravity; 1 for the paper's dimensionless cases", "m s-2", GRAVITY)
    terrain: AnyTerrain = key("shape of the bed")
    domain: Domain | None = key(
        "bounds of the points; of eastings and northings on an elevation model. Default: as far as the flow "
        "of any run comes, found by runs on wider spacing",
        default=None,
    )
    points: Points = key("layout of the points")
    release: OneOrMany | None = key(
        "what is released, one shape or a list of them; may be left out beside an inflow", default=None
    )
    inflow: Inflows = key(
        "hydrographs that come in through sections, one or a list of them, beside a release or without one",
        default=(),
    )
    sections: tuple[MeasuredSection, ...] = key(
        "lines that discharge, volume, peak and arrival are wanted of", default=()
    )
    material: Material = key("friction and earth pressure")
    erodible_bed: ErodibleBed | None = key(
        "what the flow may take up from its bed. Default: nothing", default=None
    )
    structures: tuple[AnyStructure, ...] = key(
        "dams, basins and buildings; each dam and basin is made on the ground that those before it leave",
        default=(),
    )
    boundaries: Boundaries = key("what stands at each side", default=Boundaries())
    scheme: AnyScheme = key("numerical choices", default=DEFAULT_SCHEME)
    time: Time = key("duration and frames", default=Time())
    output: Output = key("what is kept", default=Output())
    sweep: dict[str, Annotated[tuple[Scalar, ...], Field(min_length=1)]] = key(
        "lists of values by dotted key (`material.bed_friction`, `release.0.volume`); "
        "the runs are the product of all lists, the last varying fastest",
        default={},
    )
    sample: Sample | None = key("parameters drawn at random", default=None)
    weights: Numbers | None = key(
        "how much each run counts in probabilities, relative to the others: a list with one a run, or lists "
        "by key of the sweep with one an entry, which multiply. Default: all equally",
        default=None,
    )
    return_periods: Periods | None = key(
        "mean time between events like that of a run: one number for all runs, a list with one a run, one "
        "list by key of the sweep, or on an elevation model `polygons` for the attribute `return_period` of "
        "the polygons that a run releases",
        "years",
        None,
    )
    receptors: Receptors = key(
        "places of which depth, speed, pressure and arrival are wanted: a list, or on an elevation model a "
        "file of points, lines and polygons (GeoPackage, GeoJSON, Shapefile) in any reference system, of "
        "several layers one as `{file: places.gpkg, layer: houses}`; no change of the scenario",
        default=(),
    )

    georeference: Georeference | None = key(
        "where the profile lies on the map; no change of the scenario", default=None
    )
    hazard: Hazard = key("what is mapped of the results; no change of the scenario", default=Hazard())
    report: Report = key("head of the report; no change of the scenario", default=Report())

    # of all runs, s; hydrographs of files are known once they are read
    _last_inflow: float = PrivateAttr(default=0.0)

    @model_validator(mode="after")
    def _listed(self) -> Settings:
        if not isinstance(self.inflow, tuple):
            # frozen for all but its own making
            object.__setattr__(self, "inflow", (self.inflow,))
        return self

    @model_validator(mode="after")
    def _countable(self) -> Settings:
        if self.domain is None:
            return self
        (x0, x1), (y0, y1) = self.domain.x, self.domain.y
        count, most = self.points.estimate(x1 - x0, y1 - y0), self.points.most
        if count > most:
            at = "points.count" if getattr(self.points, "count", None) else "points.spacing"
            raise relation(f"expected at most {most:,} points, found {count:.3g}", at, "domain")
        return self

    @model_validator(mode="after")
    def _fits_terrain(self) -> Settings:
        error = inflow_settings.unfit(self) or unfit(self) or erodible_bed.unfit(self)
        error = error or unfit_structures(self)
        if error is not None:
            raise error
        for path, zone in self.all_zones:
            if zone.file is not None and not self.on_surface:
                found = "expected corners, as a file of polygons needs an elevation model, found a file"
                place = "polygon" if zone.raster is None else "raster"
                raise relation(found, (*path, place), "terrain")
        return self

    @model_validator(mode="after")
    def _found(self) -> Settings:
        if self.domain is not None or self.on_surface:
            return self
        for side, stands in self.boundaries:
            if stands != "open":
                raise relation("expected a domain, as a side is not open", "domain", f"boundaries.{side}")
        if getattr(self.points, "spacing", None) is None:
            raise relation(
                "expected a domain, as the points have no spacing of their own", "domain", "points"
            )
        return self

    @model_validator(mode="after")
    def _possible(self) -> Settings:
        if self.scheme.source is Collocation:
            for side, stands in self.boundaries:
                if isinstance(stands, GivenDepth):
                    found = "expected open, wall or no-slip with form collocation, found a given depth"
                    raise relation(found, f"boundaries.{side}", "scheme.form")
            law, pressure = self.material.laws()
            if pressure.along_flow:
                found = f"expected another law with form collocation, found {tag(type(pressure))}"
                raise relation(found, "material.earth_pressure", "scheme.form")
            if not isinstance(law, Coulomb):
                found = f"expected coulomb or voellmy with form collocation, found {tag(type(law))}"
                raise relation(found, "material.friction", "scheme.form")
            if self.zones:
                found = "expected form weighted-residual with zones, found collocation"
                raise relation(found, "scheme.form", "material.zones")
        return self

    @model_validator(mode="after")
    def _weighted(self) -> Settings:
        self._check_numbers("weights", self.weights)
        if self.return_periods == OF_POLYGONS and not self.on_surface:
            found = "expected numbers, as polygons need an elevation model, found polygons"
            raise relation(found, "return_periods", "terrain")
        if not isinstance(self.return_periods, int | float | str):
            self._check_numbers("return_periods", self.return_periods)
        if isinstance(self.return_periods, dict) and len(self.return_periods) != 1:
            raise relation(f"expected one list, found {len(self.return_periods)}", "return_periods")
        return self

    @model_validator(mode="after")
    def _timed(self) -> Settings:
        if self.time.end is None and "gravity" in self.varied:
            raise relation("expected a time, as gravity differs between the runs", "time.end", "gravity")
        law, _ = self.material.laws()
        if self.time.end is None and not law.comes_to_rest:
            found = f"expected a time, as {tag(type(law))} friction stops nothing, found nothing"
            raise relation(found, "time.end", "material.friction")
        if self.time.end is None and self.time.output_every is not None and self.domain is not None:
            frames = self.latest_end / self.time.output_every
            if not 1 <= frames <= MOST_FRAMES:
                expected = f"expected 1 to {MOST_FRAMES:,} frames until {self.latest_end:g} s"
                found = f"{expected}, found {frames:.3g}"
                raise relation(found, "time.output_every", "time.end", "domain")
        every = self.output.section_every
        known = self.time.end is not None or (self.domain is not None and not self.inflow)
        if every is not None and known:
            samples, end = self.latest_end / every, self.latest_end
            if samples > MOST_SAMPLES:
                found = f"expected at most {MOST_SAMPLES:,} samples until {end:g} s, found {samples:.3g}"
                least = f"write {end / MOST_SAMPLES:.3g} or more"
                raise relation(f"{found}; {least}", "output.section_every", "time.end", "domain")
        return self

    @model_validator(mode="after")
    def _levelled(self) -> Settings:
        levels = () if self.sample is None else self.sample.levels
        if not levels:
            return self
        if not isinstance(self.points, LatticePoints):
            raise relation("expected a lattice with levels", "points", "sample.levels")
        closest = levels[-1].spacing
        if self.points.spacing != closest:
            found = f"expected that of the last level, {closest:g}, found {self.points.spacing:g}"
            raise relation(found, "points.spacing", "sample.levels")
        if self.domain is None:
            raise relation("expected a domain, which all levels share", "domain", "sample.levels")
        if self.output.threshold is None:
            raise relation("expected a depth, which all levels share", "output.threshold", "sample.levels")
        for name in ("weights", "return_periods"):
            if isinstance(getattr(self, name), tuple):
                found = "expected lists by key of the sweep with levels, found one a run"
                raise relation(found, name, "sample.levels")
        return self

    @model_validator(mode="after")
    def _receptors_fit(self) -> Settings:
        if not isinstance(self.receptors, tuple) and not self.on_surface:
            raise relation(
                "expected a list, as a file takes an elevation model, found a file", "receptors", "terrain"
            )
        names = [receptor.name for receptor in self.places]
        for i, name in enumerate(names):
            if name in names[:i]:
                raise relation(f"expected a name of its own, found '{name}' again", f"receptors.{i}.name")
        return self

    def _check_numbers(
        self, name: str, numbers: tuple[float, ...] | dict[str, tuple[float, ...]] | None
    ) -> None:
        """Refuse numbers that are not as many as runs, or as entries of the lists of the sweep."""
        if isinstance(numbers, tuple):
            if len(numbers) != self.run_count:
                raise relation(f"expected {self.run_count:,} values, one a run, found {len(numbers)}", name)
            return
        for swept, entries in (numbers or {}).items():
            if swept not in self.sweep:
                known = ", ".join(self.sweep) or "none"
                raise relation(f"expected a key of the sweep ({known}), found '{swept}'", (name, swept))
            if len(entries) != len(self.sweep[swept]):
                expected = f"expected {len(self.sweep[swept])} values, one an entry of the sweep's list"
                raise relation(f"{expected}, found {len(entries)}", (name, swept))

    @property
    def run_count(self) -> int:
        """Number of runs: entries of the sweep's lists times draws of the sample."""
        return prod(map(len, self.sweep.values())) * (1 if self.sample is None else self.sample.rows)

    @property
    def varied(self) -> tuple[str, ...]:
        """Keys that differ between runs: those of the sweep, then those of the sample."""
        return (*self.sweep, *(() if self.sample is None else self.sample.values))

    @property
    def bounds(self) -> Domain:
        """The domain, which is known once it was given or found."""
        assert self.domain is not None
        return self.domain

    @property
    def on_surface(self) -> bool:
        """Whether the terrain is an elevation model."""
        return isinstance(self.terrain, ElevationTerrain)

    @property
    def table_file(self) -> str | None:
        """File of the elevation table, where the terrain is read from one."""
        found: str | None = getattr(self.terrain, "file", None)
        return found

    @property
    def latest_end(self) -> float:
        """Time that runs end at, at rest or not, s; it takes a domain where ``time.end`` is left out."""
        if self.time.end is not None:
            return self.time.end
        length = max(high - low for low, high in (self.bounds.x, self.bounds.y))
        latest = LATEST * sqrt(length / self.gravity) + self._last_inflow
        # two digits are enough, and are read more easily
        step = 10.0 ** (floor(log10(latest)) - 1)
        return ceil(latest / step) * step

    @property
    def last_inflow(self) -> float:
        """Time after which nothing comes in in any run, s."""
        return self._last_inflow

    def fed_until(self, last_inflow: float) -> Settings:
        """Give the settings with the time after which nothing comes in in any run, s."""
        found = self.model_copy()
        found._last_inflow = last_inflow
        return found

    @property
    def density(self) -> float:
        """Density of the flow for its dynamic pressure, kg m-3; of its material unless one is written."""
        return self.hazard.density or getattr(self.material, "density") or USUAL_DENSITY  # noqa: B009

    @property
    def zones(self) -> tuple[Zone, ...]:
        """The zones of friction, in their order."""
        return getattr(self.material, "zones") or ()  # noqa: B009

    @property
    def all_zones(self) -> Iterator[tuple[tuple[str | int, ...], ZoneKeys]]:
        """The zones of friction and of erosion, each with its path."""
        for i, zone in enumerate(self.zones):
            yield ("material", "zones", i), zone
        for i, zone in enumerate((self.erodible_bed and self.erodible_bed.zones) or ()):
            yield ("erodible_bed", "zones", i), zone

    @property
    def places(self) -> tuple[Receptor, ...]:
        """The receptors; none as long as their file was not read."""
        return self.receptors if isinstance(self.receptors, tuple) else ()

    @property
    def releases(self) -> tuple[AnyRelease, ...]:
        """The releases as a tuple, however they were written; empty without any."""
        if self.release is None:
            return ()
        return self.release if isinstance(self.release, tuple) else (self.release,)

    @property
    def hydrograph_files(self) -> tuple[str, ...]:
        """Files of hydrographs."""
        return tuple(each.file for each in self.inflow if each.file is not None)


def json_schema() -> dict[str, Any]:
    """Give the JSON Schema of a scenario file, for editors."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **Settings.model_json_schema()}
