# ruff: noqa: E501 - a message is one line
import hashlib
import io
import zipfile

import numpy as np
import pytest

from pipeline.inputs.elevation_table import read
from pipeline.inputs.text_table import heading
from pipeline.mistakes import BadInput


def table(tmp_path, text):
    path = tmp_path / "t.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def refused(tmp_path, text):
    with pytest.raises(BadInput) as caught:
        read(table(tmp_path, text))
    return str(caught.value).replace(f"{tmp_path}/", "").splitlines()


@pytest.mark.parametrize(
    "text",
    [
        "distance,elevation\n0,90\n100,50\n",
        "elevation,distance\n90,0\n50,100\n",
        "\ufeffDistance,Elevation\r\n0,90\r\n100,50\r\n",
        "Distance (m), Elevation [m]\n0, 90\n100, 50\n",
        "distance_m,elev_m\n0,90\n100,50\n",
        '"distance","elevation"\n"0","90"\n"100","50"\n',
        "d,z\n\n0,90\n# surveyed in June\n100,50\n\n",
        "# distance, elevation\n0,9e1\n1e2,50.0\n",
        "id,Elevation,Distance,remark\n1,90,0,top\n2,50,100,\n",
        "Easting,Northing,Distance,Elevation\n2600000,1200000,0,90\n2600060,1200080,100,50\n",
        "distance (km),elevation\n0,90\n0.1,50\n",
        "Station/m,Höhe/m\n0,90\n100,50\n",
        "Distance (m),Elevation (m a.s.l.)\n0,90\n100,50\n",
        "Distance (m),Elevation (masl)\n0,90\n100,50\n",
        "Distanz [m],Höhe [m ü. M.]\n0,90\n100,50\n",
        "Distanz [m],Höhe [m ü.NHN]\n0,90\n100,50\n",
        "distance (km),elevation (km above sea level)\n0,0.09\n0.1,0.05\n",
    ],
)
def test_columns_are_found_by_their_headings_and_brought_to_metres(tmp_path, text):
    found = read(table(tmp_path, text))
    assert found.distances.tolist() == [0, 100]
    assert found.elevations.tolist() == [90, 50]
    assert found.digest == hashlib.sha256(np.array([[0.0, 90], [100, 50]]).tobytes()).hexdigest()
    assert found.doubts == ()


@pytest.mark.parametrize("unit", ["ft", "feet", "Foot", "FT."])
def test_feet_are_brought_to_metres(tmp_path, unit):
    found = read(table(tmp_path, f"distance ({unit}),elevation ({unit})\n0,1000\n500,900\n"))
    np.testing.assert_allclose(found.distances, [0, 152.4], rtol=1e-15)
    np.testing.assert_allclose(found.elevations, [304.8, 274.32], rtol=1e-15)


def test_a_unit_may_stand_behind_a_name_in_several_ways():
    texts = ("Distance (ft)", "distance [ft]", "distance/ft", "distance_ft", "distance ft", "DISTANCE FT")
    assert {(found.name, found.unit) for found in map(heading, texts)} == {("distance", "ft")}


HEADINGS = "t.csv:1:1: expected the headings distance and elevation, found"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a,b\n0,90\n100,50\n", f"{HEADINGS} a, b"),
        ("distance,depth\n0,90\n100,50\n", f"{HEADINGS} distance, depth"),
        ("distance,elevation,z\n0,90,90\n100,50,50\n", f"{HEADINGS} distance, elevation, z more than once"),
        (
            "x,y,z\n2600000,1200000,90\n2600060,1200080,50\n",
            f"{HEADINGS} places on the map (x, y, z); distance is counted along the profile",
        ),
        ("slope distance,elevation\n0,90\n100,50\n", f"{HEADINGS} slope distance, elevation"),
        (
            "distance (yd),elevation\n0,90\n100,50\n",
            "t.csv:1:1: expected m, km or ft as the unit of a heading, found distance (yd)",
        ),
        (
            "distance;elevation\n0;90\n100;50\n",
            "t.csv:1:1: expected columns separated by commas, found semicolons; save it as CSV with commas between columns and points in numbers",
        ),
        (
            "distance;elevation\n0;90,5\n100;50,1\n",
            "t.csv:1:1: expected columns separated by commas, found semicolons and decimal commas; save it as CSV with commas between columns and points in numbers",
        ),
        (
            "distance\televation\n0\t90\n100\t50\n",
            "t.csv:1:1: expected columns separated by commas, found tabs; save it as CSV with commas between columns and points in numbers",
        ),
        (
            "distance,elevation\n0,90\n100,0,50,5\n",
            "t.csv:3:7: expected 2 values, distance, elevation, found 4; decimals take a point, not a comma",
        ),
        (
            'distance,elevation\n0,90\n100,"50,5"\n',
            "t.csv:3:5: elevation: expected a number with a decimal point, found '50,5'",
        ),
        (
            'distance,elevation\n0,90\n"1,000",50\n',
            "t.csv:3:1: distance: expected a number without separators in it, found '1,000'",
        ),
        (
            "distance,elevation\n0,90\n50,-9999\n100,50\n",
            "t.csv:3:4: elevation: expected an elevation, found -9999, which means no data; leave the row out",
        ),
        (
            "distance,elevation\n0,90\n50,-3.4028234663852886e+38\n100,50\n",
            "t.csv:3:4: elevation: expected an elevation, found -3.40282346638529e+38, which means no data; leave the row out",
        ),
        ("distance,elevation\n0,90\n50,\n", "t.csv:3:4: elevation: expected a finite number, found ''"),
        (
            "distance,elevation\n100,50\n50,70\n0,90\n",
            "t.csv:2:1: distance: expected increasing distances, found decreasing ones; sort the rows by distance, or exchange the headings if they stand over the wrong columns",
        ),
        ("", "t.csv:1:1: expected a line of headings, found an empty file"),
        ("\n\n", "t.csv:1:1: expected a line of headings, found an empty file"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_rightly_is_refused_with_the_fix(tmp_path, text, message):
    assert refused(tmp_path, text) == [message]


def _spreadsheet():
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w") as book:
        book.writestr("xl/workbook.xml", "<workbook/>")
    return held.getvalue()


@pytest.mark.parametrize(
    ("data", "found"),
    [
        (b"II*\0\x08\0\0\0" + bytes(100), "a TIFF raster; sample it along the profile"),
        (_spreadsheet(), "a spreadsheet or another zipped file; save the sheet as CSV"),
        (b"ncols 4\nnrows 4\nxllcorner 0\n", "a grid of elevations; sample it along the profile"),
        (b"\x89HDF\r\n\x1a\n", "an HDF5 or NetCDF file; sample it along the profile"),
        (b'{"type": "FeatureCollection"}', "a file of JSON; export its table as CSV"),
        (b"<kml></kml>", "a file of XML; export its table as CSV"),
        ("distance,elevation\n0,1\n".encode("utf-16"), "text in UTF-16; save it in UTF-8"),
        (b"\x01\x02\0\x03", "a binary file"),
    ],
)
def test_another_kind_of_file_is_told_in_one_line(tmp_path, data, found):
    (line,) = refused(tmp_path, data)
    assert line.startswith(
        f"t.csv:1:1: expected a CSV of distance and elevation along the profile, found {found}"
    )


def test_of_many_mistakes_the_first_are_told_and_how_many_there_are(tmp_path):
    lines = refused(tmp_path, "distance,elevation\n" + "".join(f"{i},low\n" for i in range(100)))
    assert len(lines) == 11
    assert lines[-1] == "t.csv:12:4: and 90 more mistakes from here on"


def test_slopes_that_nobody_has_are_doubted_with_their_place(tmp_path):
    swapped = read(table(tmp_path, "distance,elevation\n65,0\n70,200\n90,300\n140,400\n200,500\n"))
    assert swapped.doubts[1:] == (
        "elevation rises from 0 to 500 m along the profile: what is released flows toward smaller x",
        "3 pieces of the profile steeper than 60 degrees, the steepest 88.6 degrees from distance 65 to 70 m: check columns, units and rows",
    )
    with pytest.raises(BadInput, match="or exchange the headings if they stand over the wrong columns"):
        read(table(tmp_path, "distance,elevation\n500,0\n400,50\n350,120\n"))
    gap = read(table(tmp_path, "distance,elevation\n0,700\n50,0\n100,650\n"))
    assert gap.doubts[0].startswith("2 pieces of the profile steeper than 60 degrees, the steepest 85.9")


def test_distances_that_do_not_begin_at_0_are_told(tmp_path):
    found = read(table(tmp_path, "distance,elevation\n120,90\n200,50\n"))
    assert found.distances.tolist() == [120, 200]
    assert found.doubts == (
        "distances begin at 120 m: x is counted from there, horizontal distance and the origin of a georeference from the table's own 0",
    )
