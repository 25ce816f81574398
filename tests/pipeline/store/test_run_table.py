import json
from dataclasses import replace

import numpy as np
import pandas as pd
from templates import row, template

from pipeline.store import zarr_store
from pipeline.store.layout import create
from pipeline.store.run_table import markdown, read, units
from pipeline.store.variables import PER_RUN, Status, Variable, kept


def test_parameters_are_in_the_order_of_the_design_and_what_was_not_computed_is_missing(tmp_path):
    path = tmp_path / "trial.zarr"
    keys = {"release.z": "z", "material.m": "m", "release.a": "a"}
    plain = template(runs=3)
    named = [
        (Variable(name, ("run",), "float64", "m", key, attributes={"key": key}), np.arange(3.0) + len(name))
        for key, name in sorted(keys.items())
    ]
    content = json.dumps(
        {"sweep": dict.fromkeys(["release.z", "material.m"]), "sample": {"values": {"release.a": 1}}}
    )
    attributes = {**plain.attributes, "scenario_content": content}
    create(path, replace(plain, coordinates=(*plain.coordinates, *named), attributes=attributes))
    zarr_store.write(path, kept(), {1: row(1)}, {1: Status.DONE})
    table = read(tmp_path)
    assert [*table.columns] == ["scenario", "run", "status", *keys.values(), *(v.name for v in PER_RUN)]
    assert table["status"].tolist() == ["pending", "done", "pending"]
    assert table["steps"].isna().tolist() == [True, False, True]
    assert table["steps"][1] == 11
    assert table["volume_out"].isna().tolist() == [True, False, True]
    assert table.attrs["units"]["z"] == "m"
    with zarr_store.open_store(path) as opened:
        assert [c.attrs["key"] for c in opened.coords.values() if "key" in c.attrs] == [*keys]


def test_bars_and_ends_of_lines_in_names_keep_a_markdown_table_whole():
    table = pd.DataFrame({"receptor": ["road | bridge", "two\nlines", "back\\slash"], "a|b": [1.0, 2.0, 3.0]})
    head, rule, *rows = markdown(table).splitlines()
    assert head == "| receptor | a\\|b |"
    assert rule == "| --- | --- |"
    assert rows == ["| road \\| bridge | 1 |", "| two lines | 2 |", "| back\\\\slash | 3 |"]


def test_a_statistic_of_a_statistic_has_the_unit_of_its_quantity():
    table = pd.DataFrame(columns=["receptor", "median_max_pressure", "largest_max_depth", "first_arrival"])
    assert units(table) == {"median_max_pressure": "kPa", "largest_max_depth": "m", "first_arrival": "s"}
