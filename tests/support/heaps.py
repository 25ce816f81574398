"""A small scenario on the ground with receptors and return periods, that takes a second to run."""

HEAP = {
    "name": "heap",
    "terrain": {"profile": "bend", "angle": 35, "start": 40, "end": 60},
    "domain": {"x": [0, 160], "y": [-24, 24]},
    "points": {"spacing": 2},
    "release": {"shape": "cap", "centre": [14, 0], "radius": 10, "height": 3},
    "material": {"bed_friction": 25, "earth_pressure": "isotropic"},
    "time": {"end": 24, "output_every": 4},
    "output": {"threshold": 0.05},
    "sweep": {"material.bed_friction": [24, 26, 28, 31]},
    "return_periods": {"material.bed_friction": [300, 100, 100, 30]},
    "georeference": {"crs": "EPSG:2056", "origin": [2700000, 1200000], "azimuth": 120},
    "receptors": [{"name": "Häusli", "point": [62, 0]}, {"name": "road", "line": [[60, -20], [60, 20]]}],
    "hazard": {"depth": [0.2], "speed": [2]},
}
