import numpy as np
import pytest
from root import ROOT

from pipeline.settings.settings import FIELDS as SETTINGS_FIELDS
from pipeline.store.variables import COORDINATES, FIELDS, STATUS, Status, kept, markdown

DOCS = ROOT / "docs" / "store.md"


def test_names_are_unique():
    names = [v.name for v in (*COORDINATES, *kept())]
    assert len(set(names)) == len(names)


def test_fields_of_the_settings_are_those_of_the_store():
    assert [v.name for v in FIELDS] == list(SETTINGS_FIELDS)


def test_every_number_has_units_and_a_value_for_not_computed():
    for variable in (*COORDINATES, *kept()):
        assert variable.long_name
        if variable.dtype.startswith("float"):
            assert variable.units
            assert np.isnan(variable.fill)
    steps = next(v for v in kept() if v.name == "steps")
    assert steps.fill == steps.attributes["_FillValue"] == -1


def test_status_has_cf_flags_and_no_fill_value():
    assert STATUS.cf_attributes["flag_values"] == [0, 1, 2, 3, 4, 5]
    assert STATUS.cf_attributes["flag_meanings"] == (
        "pending done failed done_but_overrun cut_off overrun_and_cut_off"
    )
    assert "_FillValue" not in STATUS.attributes
    assert STATUS.fill == Status.PENDING == 0


def test_narrowing_leaves_out_fields_only():
    names = [v.name for v in kept(["deposit_depth"])]
    assert names == ["deposit_depth", *(v.name for v in kept() if not v.narrowable)]
    with pytest.raises(ValueError, match="not a field: deph"):
        kept(["deph"])


def test_documented_table_is_current():
    text = DOCS.read_text(encoding="utf-8")
    between = text.split("<!-- variables -->")[1]
    assert between.strip() == markdown(), "run python -m pipeline.store.variables and paste its table"
