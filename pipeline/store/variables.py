"""The one table of what a store holds: the template, the summary table and the documentation come from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Any, Literal

FRAME = ("run", "time", "y", "x")
CELL = ("run", "y", "x")
RUN = ("run",)


# variable that says how x and y lie on the Earth
GRID_MAPPING = "spatial_ref"
# attributes of a store of chosen runs: what they were chosen for, and from which runs
CHOSEN_FOR, CHOSEN_FROM = "chosen_for", "chosen_from"
_NOWHERE = "missing, as it has no meaning on an elevation model"
# what variables are on an elevation model, where that is something else
ON_SURFACE = {
    "velocity_x": "velocity along the bed in the vertical plane toward east",
    "velocity_y": "velocity along the bed, square to that, toward north",
    **dict.fromkeys(
        ("front_x", "tail_x", "deposit_length", "deposit_width", "deposit_centroid_x", "flow_front_x"),
        _NOWHERE,
    ),
    "deposit_area": "area in plan of the cells of the deposit",
    "runout_distance": "horizontal distance from the release's highest cell to the deposit's lowest",
    "drop_height": "height of the release's highest cell above the deposit's lowest",
    "reach_angle": "arctangent of drop height over runout distance",
    "flow_runout_distance": (
        "horizontal distance from the release's highest cell to the lowest that the flow reached"
    ),
    "peak_speed": "largest speed over all time steps where the flow was deeper than 0.05 m",
    "volume_lost": "volume of the release outside the domain or on no data, never on the points",
    "volume_out_open": "volume that left through open sides or came to where there is no data",
    "failure_x": "easting of the failure's place",
    "failure_y": "northing of the failure's place",
}


class Status(IntEnum):
    """What became of a run; the only thing a rerun looks at."""

    PENDING = 0
    DONE = 1
    FAILED = 2
    OVERRUN = 3
    CUT_OFF = 4
    OVERRUN_AND_CUT_OFF = 5

    @property
    def words(self) -> str:
        """The status as it stands in tables and in CF ``flag_meanings``."""
        return "done_but_overrun" if self is Status.OVERRUN else self.name.lower()

    @property
    def plain_words(self) -> str:
        """The status as people read it: ``cut off``, ``done but overrun``."""
        return self.words.replace("_", " ")

    @property
    def is_overrun(self) -> bool:
        """Whether material left through an open side."""
        return self in (Status.OVERRUN, Status.OVERRUN_AND_CUT_OFF)

    @property
    def is_cut_off(self) -> bool:
        """Whether material was still moving at the end."""
        return self in (Status.CUT_OFF, Status.OVERRUN_AND_CUT_OFF)


# a run of these has its values
COMPUTED = (Status.DONE, Status.OVERRUN, Status.CUT_OFF, Status.OVERRUN_AND_CUT_OFF)


@dataclass(frozen=True)
class Variable:
    """One variable of the store.

    Parameters
    ----------
    name : str
        Name in the store, in the table and in the documentation.
    dims : tuple of str
        Dimensions, outermost first.
    dtype : str
        ``float32``, ``float64``, ``int8``, ``int64`` or ``string``.
    units : str
        CF units; ``""`` for what has none, ``1`` for a pure number.
    long_name : str
        What it is.
    fill : float, int or str
        Value of what was never computed.
    attributes : dict
        Further CF attributes.
    """

    name: str
    dims: tuple[str, ...]
    dtype: Literal["float32", "float64", "int8", "int64", "string"]
    units: str
    long_name: str
    fill: float | int | str = float("nan")
    attributes: dict[str, Any] = field(default_factory=dict)

    @property
    def narrowable(self) -> bool:
        """Whether ``output.fields`` may leave it out: every field over the cells may be."""
        return "run" in self.dims and bool({"x", "point"} & set(self.dims))

    def on_cloud(self) -> Variable:
        """Give the same on the points of a cloud, which have one dimension."""
        dims = dict.fromkeys("point" if d in ("x", "y") else d for d in self.dims)
        return replace(self, dims=tuple(dims))

    def on_surface(self) -> Variable:
        """Give the same on an elevation model: over northings and eastings, with a grid mapping."""
        mapped = {"grid_mapping": GRID_MAPPING} if {"x", "y"} <= {*self.dims} else {}
        words = ON_SURFACE.get(self.name, self.long_name)
        return replace(self, long_name=words, attributes={**self.attributes, **mapped})

    @property
    def cf_attributes(self) -> dict[str, Any]:
        """Attributes as they are written, units included."""
        units = {"units": self.units} if self.units else {}
        return {"long_name": self.long_name, **units, **self.attributes}


def _scalar(name: str, units: str, long_name: str) -> Variable:
    return Variable(name, RUN, "float64", units, long_name)


def _count(name: str, long_name: str) -> Variable:
    return Variable(name, RUN, "int64", "1", f"{long_name}; -1 where not computed", -1, {"_FillValue": -1})


def _text(name: str, long_name: str) -> Variable:
    return Variable(name, RUN, "string", "", long_name, "")


STATUS = Variable(
    "status",
    RUN,
    "int8",
    "",
    "what became of the run",
    int(Status.PENDING),
    {"flag_values": [int(s) for s in Status], "flag_meanings": " ".join(s.words for s in Status)},
)

FIELDS = (
    Variable("depth", FRAME, "float32", "m", "flow depth normal to the bed"),
    Variable("velocity_x", FRAME, "float32", "m s-1", "velocity along the bed, positive downslope"),
    Variable("velocity_y", FRAME, "float32", "m s-1", "velocity across the bed"),
    Variable("max_depth", CELL, "float32", "m", "largest depth over all time steps"),
    Variable("max_speed", CELL, "float32", "m s-1", "largest speed over all time steps"),
    Variable(
        "max_momentum_flux",
        CELL,
        "float32",
        "m3 s-2",
        "largest momentum flux, depth times speed squared, over all time steps",
    ),
    Variable("arrival_time", CELL, "float32", "s", "time at which the flow first arrives"),
    Variable("deposit_depth", CELL, "float32", "m", "depth of the last good state"),
    Variable(
        "erosion_depth",
        CELL,
        "float32",
        "m",
        "depth eroded normal to the bed until the last good state; with an erodible bed only",
    ),
    Variable(
        "bed_change",
        CELL,
        "float32",
        "m",
        "change of the ground's elevation, deposit_depth less erosion_depth measured vertically; with an "
        "erodible bed only",
    ),
)
# what a store holds of runs on an erodible bed alone
ERODED = ("erosion_depth", "bed_change")
SERIES = (
    Variable(
        "entrained",
        ("run", "time"),
        "float64",
        "m3",
        "volume that the flow has taken up from its bed; with an erodible bed only",
    ),
)

SUMMARIES = (
    _scalar("front_x", "m", "arc length of the deposit's toe, its farthest cell along the flow"),
    _scalar("tail_x", "m", "arc length of the deposit's other end"),
    _scalar("deposit_length", "m", "extent of the deposit along the bed"),
    _scalar("deposit_width", "m", "extent of the deposit across the bed"),
    _scalar("deposit_area", "m2", "area of the cells of the deposit"),
    _scalar("deposit_volume", "m3", "volume in the cells of the deposit"),
    _scalar("deposit_max_depth", "m", "largest depth of the deposit"),
    _scalar("deposit_centroid_x", "m", "arc length of the deposit's centre of volume"),
    _scalar("runout_distance", "m", "horizontal distance from the crown of the release to the deposit's toe"),
    _scalar("drop_height", "m", "height of the crown of the release above the deposit's toe"),
    _scalar("reach_angle", "degree", "arctangent of drop height over runout distance"),
    _scalar("affected_area", "m2", "area in plan of the cells that the flow reached"),
    _scalar("flow_front_x", "m", "arc length of the farthest cell that the flow reached"),
    _scalar(
        "flow_runout_distance",
        "m",
        "horizontal distance from the crown of the release to the farthest cell that the flow reached",
    ),
    _scalar(
        "flow_path_length",
        "m",
        "length over the ground of the shortest way within what the flow reached, from the release's highest "
        "cell to the lowest; on elevation models only",
    ),
    _scalar("lowest_elevation", "m", "lowest elevation that the flow reached; on elevation models only"),
    _scalar(
        "lifted_share",
        "1",
        "share of the cells reached where the largest speed, down the steepest slope, may have lifted the "
        "flow off the bed; on elevation models only",
    ),
    _scalar("peak_depth", "m", "largest depth anywhere, over all time steps"),
    _scalar("peak_speed", "m s-1", "largest speed anywhere, over all time steps"),
)

EROSION = (_scalar("erosion_max_depth", "m", "largest depth eroded anywhere; with an erodible bed only"),)

VOLUMES = (
    _scalar("volume_asked", "m3", "volume of the release as asked for"),
    _scalar("volume_released", "m3", "volume of the release on the points"),
    _scalar("volume_lost", "m3", "volume of the release outside the domain, never on the points"),
    _scalar("volume_in", "m3", "volume that came in through sections of inflows and the boundaries"),
    _scalar("volume_entrained", "m3", "volume that the flow took up from its bed"),
    _scalar("volume_out", "m3", "volume that left through the boundaries"),
    _scalar("volume_out_open", "m3", "volume that left through open sides"),
    _scalar("share_out", "1", "share of all that was in the flow that left through open sides"),
    _scalar("volume_moving", "m3", "volume that still moves in the last good state"),
    _scalar(
        "volume_error",
        "1",
        "error of the volume ledger relative to the volume released, come in and entrained",
    ),
)

COSTS = (
    _count("steps", "time steps taken"),
    _scalar("last_time", "s", "time of the last good state, which the deposit is of"),
    _scalar("rest_time", "s", "time at which everything was at rest; missing while still moving"),
    _scalar("wall_time", "s", "elapsed time of the time loop with its maxima"),
    _scalar("cpu_time", "s", "processor time of the time loop with its maxima"),
)

FAILURES = (
    _text("failure_reason", "why, when and where the run failed; empty where it did not"),
    _scalar("failure_time", "s", "model time of the failure"),
    _scalar("failure_x", "m", "arc length of the failure's place"),
    _scalar("failure_y", "m", "position of the failure's place across the bed"),
)

WARNINGS = (
    _count("warnings", "warnings of the numerics"),
    _text("warning", "what they say, each once"),
)

DIGEST = _text("digest", "SHA-256 of the run's status and values, times of computing excepted")

TIMINGS = frozenset({"wall_time", "cpu_time"})
# Left out of a digest where they are 0 or missing, so that a run has the digest it had without them.
LATER = frozenset(
    {
        "volume_out_open",
        "share_out",
        "volume_moving",
        "lowest_elevation",
        "flow_path_length",
        "affected_area",
        "lifted_share",
        "volume_entrained",
        "erosion_max_depth",
    }
)

PER_RUN = (*VOLUMES, *SUMMARIES, *EROSION, *COSTS, *WARNINGS, *FAILURES)

COORDINATES = (
    Variable("time", ("time",), "float64", "s", "time since release", attributes={"axis": "T"}),
    Variable("y", ("y",), "float64", "m", "position across the bed", attributes={"axis": "Y"}),
    Variable("x", ("x",), "float64", "m", "arc length along the bed", attributes={"axis": "X"}),
    Variable("elevation", ("x",), "float64", "m", "elevation of the bed", attributes={"positive": "up"}),
    Variable("horizontal_distance", ("x",), "float64", "m", "horizontal distance along the profile"),
)


WEIGHT = Variable("weight", RUN, "float64", "1", "share of the run in probabilities; that of all is 1")
RETURN_PERIOD = Variable(
    "return_period",
    RUN,
    "float64",
    "year",
    "mean time between events like the run; only where given",
)
BUILDING = Variable(
    "building",
    ("y", "x"),
    "int8",
    "",
    "whether the cell is a building, which nothing flows through; only where there are buildings",
    0,
    {"flag_values": [0, 1], "flag_meanings": "ground building"},
)
AREA = Variable("area", ("point",), "float64", "m2", "area of the point's cell; clouds only")
PLAN_AREA = Variable(
    "plan_area",
    ("point",),
    "float64",
    "m2",
    "area in plan of the point's cell; clouds on elevation models only",
)


_CELL = ("y", "x")
SURFACE_COORDINATES = (
    Variable("time", ("time",), "float64", "s", "time since release", attributes={"axis": "T"}),
    *(
        Variable(
            axis,
            (axis,),
            "float64",
            "m",
            word,
            attributes={"standard_name": f"projection_{axis}_coordinate", "axis": axis.upper()},
        )
        for axis, word in (("y", "northing of the cell's centre"), ("x", "easting of the cell's centre"))
    ),
    Variable(
        "elevation", _CELL, "float64", "m", "elevation of the bed", attributes={"positive": "up"}
    ).on_surface(),
    Variable("area", _CELL, "float64", "m2", "area of the cell on the bed").on_surface(),
    Variable(
        "vertical_extent",
        _CELL,
        "float64",
        "1",
        "vertical extent of a layer over its depth normal to the bed, area on the bed over area in plan",
    ).on_surface(),
)
# of an elevation model, which runs may differ in
GROUND = ("elevation", "area", "vertical_extent")


_AT_SECTION = ("run", "section")
SECTIONS = (
    Variable(
        "section_volume",
        (*_AT_SECTION, "section_time"),
        "float64",
        "m3",
        "net volume that has passed a section by a time",
    ),
    Variable(
        "section_discharge",
        (*_AT_SECTION, "section_time"),
        "float64",
        "m3 s-1",
        "mean discharge through a section since the sample before",
    ),
    Variable(
        "section_peak_discharge", _AT_SECTION, "float64", "m3 s-1", "largest of the section's discharges"
    ),
    Variable("section_peak_time", _AT_SECTION, "float64", "s", "time of the sample that ends it"),
    Variable(
        "section_arrival_time",
        _AT_SECTION,
        "float64",
        "s",
        "time at which the flow is first deeper than the threshold below a section",
    ),
)
"""What passes the sections of a scenario that has some."""

SECTION_COORDINATES = (
    Variable("section", ("section",), "string", "", "name of a section; only with sections", ""),
    Variable("section_time", ("section_time",), "float64", "s", "time of a sample at sections"),
)


def grid_mapping(attributes: Mapping[str, Any]) -> Variable:
    """Give the variable of a reference system by its attributes of the CF conventions."""
    return Variable(
        GRID_MAPPING, (), "int64", "", "coordinate reference system", 0, attributes=dict(attributes)
    )


def coordinates(cloud: bool = False, surface: bool = False) -> tuple[Variable, ...]:
    """Coordinates that are known beforehand, on a lattice, on a cloud or on an elevation model."""
    if surface:
        if cloud:
            return (*(v.on_cloud() for v in SURFACE_COORDINATES), PLAN_AREA)
        return SURFACE_COORDINATES
    return (*(v.on_cloud() for v in COORDINATES), AREA) if cloud else COORDINATES


def kept(
    fields: list[str] | None = None, cloud: bool = False, surface: bool = False, erodible: bool = True
) -> tuple[Variable, ...]:
    """Variables on ``run`` in the order they are written; ``fields`` narrows those over the cells.

    ``digest`` and then ``status`` come last. Without an erodible bed what only runs on one have is left out.

    Raises
    ------
    ValueError
        If ``fields`` names something that is not a field.
    """
    names = {v.name for v in FIELDS}
    if fields is not None and (unknown := sorted(set(fields) - names)):
        raise ValueError(f"not a field: {', '.join(unknown)}; there are {', '.join(sorted(names))}")
    chosen = tuple(
        v for v in FIELDS if (fields is None or v.name in fields) and (erodible or v.name not in ERODED)
    )
    chosen += SERIES if erodible else ()
    own: tuple[Variable, ...] = PER_RUN
    if surface:
        chosen, own = (tuple(v.on_surface() for v in held) for held in (chosen, own))
    return (*(v.on_cloud() if cloud else v for v in chosen), *own, DIGEST, STATUS)


def parameter_keys(content: Mapping[str, Any]) -> list[str]:
    """Give the varied keys of a scenario's content in the order of its design: first swept, then sampled."""
    return [*content.get("sweep", {}), *(content.get("sample") or {}).get("values", {})]


def markdown() -> str:
    """Give the table of variables as it stands in ``docs/store.md``."""
    rows = [
        f"| `{v.name}` | {', '.join(v.dims)} | {v.dtype} | {v.units or '-'} | {v.long_name} |"
        for v in (
            *(*COORDINATES, AREA, PLAN_AREA, BUILDING, WEIGHT, RETURN_PERIOD),
            *(*SECTION_COORDINATES, *SECTIONS, *kept()),
        )
    ]
    return "\n".join(["| name | dimensions | type | units | what |", "|---|---|---|---|---|", *rows])


if __name__ == "__main__":
    print(markdown())
