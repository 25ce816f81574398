import pandas as pd

from pipeline.store.run_table import markdown, units


def test_bars_and_ends_of_lines_in_names_keep_a_markdown_table_whole():
    table = pd.DataFrame({"receptor": ["road | bridge", "two\nlines", "back\\slash"], "a|b": [1.0, 2.0, 3.0]})
    head, rule, *rows = markdown(table).splitlines()
    assert head == "| receptor | a\\|b |"
    assert rule == "| --- | --- |"
    assert rows == ["| road \\| bridge | 1 |", "| two lines | 2 |", "| back\\\\slash | 3 |"]


def test_a_statistic_of_a_statistic_has_the_unit_of_its_quantity():
    table = pd.DataFrame(columns=["receptor", "median_max_pressure", "largest_max_depth", "first_arrival"])
    assert units(table) == {"median_max_pressure": "kPa", "largest_max_depth": "m", "first_arrival": "s"}
