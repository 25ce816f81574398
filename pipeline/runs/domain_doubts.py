"""What is to be known of a domain that was found: where it ends too early, and what lies outside."""

from __future__ import annotations

from collections.abc import Iterator

from pipeline.inputs.ground import doubtful
from pipeline.runs.profile_ends import beyond
from pipeline.runs.runs import Runs
from pipeline.scenario import solver_objects
from pipeline.scenario.places import listed, on_no_data, part_inside
from pipeline.scenario.scenario import Scenario
from pipeline.settings.receptor import source_of
from pipeline.settings.section import Pair
from pipeline.settings.settings import Domain


def shared_cells(scenario: Scenario, found: Domain) -> Iterator[str]:
    """Say that a domain is larger than the one found for the scenario itself."""
    domain = scenario.settings.bounds
    if domain != found:
        yield f"domain x {list(domain.x)}, y {list(domain.y)} m, so that scenarios lie on the same cells"


def of_ground(scenario: Scenario) -> Iterator[str]:
    """Say what is doubtful of elevation models, and of receptors on them, within a domain that was found."""
    if scenario.ground is not None:
        for name, raster in scenario.ground.rasters.items():
            yield from (f"{name}: {line}" for line in doubtful(raster, scenario.settings.bounds))
        inside = [each for each in scenario.settings.places if part_inside(each, scenario.settings.bounds)]
        yield from on_no_data(inside, next(iter(scenario.ground.rasters.values())))


def doubts(scenario: Scenario, runs: Runs, flow: Pair, domain: Domain, unsettled: int) -> Iterator[str]:
    """Say what of a domain that was found is to be known: an end of the profile in it, receptors outside.

    flow : bounds along x of the flow of all runs, m.
    unsettled : how many runs were cut off, overrun or failed, so that flow may come outside.
    """
    if scenario.ground is None:
        yield from _beyond_profile(scenario, runs, flow)
    receptors, source = scenario.settings.places, source_of(scenario.data.get("receptors"))
    outside = [each.name for each in receptors if part_inside(each, domain) == 0]
    if outside and unsettled:
        count = f"{unsettled} of {len(runs)} runs that looked for it were cut off, overrun or failed"
        yield f"outside of the domain: {listed(outside)}; whether flow comes there is not known, as {count}"
    elif outside and source is not None:
        count = f"{len(outside)} of {len(receptors)} places of {source[0]}"
        yield f"{count} lie where no flow comes, and are left out: {listed(outside)}"
    elif outside:
        names = "all receptors" if len(outside) == len(receptors) > 1 else ", ".join(outside)
        yield f"outside of the domain, where no flow comes: {names}"


def _beyond_profile(scenario: Scenario, runs: Runs, flow: Pair) -> Iterator[str]:
    """Say that flows go beyond the ends of a profile."""
    profiles = {
        solver_objects.slope(run.settings.terrain, run.table)
        for run in (runs if any(key.startswith("terrain") for key in scenario.settings.varied) else runs[:1])
    }
    yield from filter(None, dict.fromkeys(beyond(profile, flow) for profile in profiles))
