import pandas as pd

from pipeline.store.run_table import markdown


def test_bars_and_ends_of_lines_in_names_keep_a_markdown_table_whole():
    table = pd.DataFrame({"receptor": ["road | bridge", "two\nlines", "back\\slash"], "a|b": [1.0, 2.0, 3.0]})
    head, rule, *rows = markdown(table).splitlines()
    assert head == "| receptor | a\\|b |"
    assert rule == "| --- | --- |"
    assert rows == ["| road \\| bridge | 1 |", "| two lines | 2 |", "| back\\\\slash | 3 |"]
