"""The shipped catalogue, and a small scenario for tests."""

from __future__ import annotations

from root import ROOT

SCENARIOS = sorted((ROOT / "scenarios").glob("*.yaml"))
SCENARIO = """\
name: {name}
description: a box on a plane
terrain: {{profile: plane, angle: 30}}
domain: {{x: [0, 10], y: [-2, 2]}}
points: {{layout: lattice, spacing: 0.5}}
release: {{shape: box, x: [1, 3], y: [-1, 1], height: 0.5}}
material: {{bed_friction: 25, earth_pressure: isotropic}}
time: {{end: 1, output_every: 0.5}}
"""
