"""What the spacing leaves open of plain maps, on a sheet that is thinner on the closer of two spacings."""

import numpy as np
import pytest
from sampled_stores import CLOSE, SPACING, sheet

from pipeline.assess.ensemble import ensemble
from pipeline.hazard.discretisation import with_discretisation
from pipeline.hazard.layers import layers
from pipeline.hazard.mapping import map_hazard
from pipeline.scenario.scenario import stored


@pytest.fixture(scope="module")
def stores():
    return sheet(levels="both")


@pytest.fixture(scope="module")
def found(stores):
    asked = stored(stores[0].attrs).hazard
    coarse, fine = map(ensemble, stores)
    return with_discretisation(map_hazard(coarse, asked), coarse, fine, asked, 1)


def test_a_share_has_that_of_the_runs_that_change_side(stores, found):
    first, second = (store["max_depth"].to_numpy()[:16] for store in stores)
    # each second point of the closer spacing is one of the wider
    flips = ((first > 0.5) != (second[:, ::2, ::2] > 0.5)).mean(axis=0)
    assert found["depth_exceedance_discretisation"].sel(depth_threshold=0.5).to_numpy() == pytest.approx(
        flips
    )
    assert flips.max() > 0.1
    assert found.attrs["discretisation"] == f"from {SPACING:g} to {CLOSE:g} m, by 16 runs on both"


def test_a_quantile_has_the_root_mean_square_change_of_a_run(stores, found):
    first, second = (store["max_depth"].to_numpy()[:16] for store in stores)
    change = np.sqrt(((first - second[:, ::2, ::2]) ** 2).mean(axis=0))
    assert found["depth_quantile_discretisation"].to_numpy() == pytest.approx(change, abs=1e-6)


def test_it_is_a_map_of_its_own_and_no_other_map_changes(stores, found):
    plain = map_hazard(ensemble(stores[0]), stored(stores[0].attrs).hazard)
    names = [layer.name for layer in layers(found)]
    assert [name for name in names if not name.endswith("_discretisation")] == [
        layer.name for layer in layers(plain)
    ]
    assert "depth_above_0.5_discretisation" in names
    for name, values in plain.data_vars.items():
        assert found[name].equals(values)


def test_without_a_run_on_both_spacings_it_is_not_estimated(stores):
    asked = stored(stores[0].attrs).hazard
    coarse, fine = ensemble(stores[0]), ensemble(stores[1].assign(status=("run", np.zeros(16, int))))
    maps = with_discretisation(map_hazard(coarse, asked), coarse, fine, asked, 1)
    assert maps.attrs["discretisation"] == "not estimated: no run is computed on both spacings"
    assert not [name for name in maps.data_vars if str(name).endswith("_discretisation")]
