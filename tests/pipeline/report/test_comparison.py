import subprocess
import sys

import pandas as pd
import pytest
from PIL import Image

# before anything leaves the domain
SHORT = "end: 1, output_every: 0.5", "end: 0.1, output_every: 0.05"
BEND = "{profile: plane, angle: 30}", "{profile: bend, angle: 30, start: 4, end: 8}"
LATTICE = "{layout: lattice, spacing: 0.5}"


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Two small scenarios of one box, on a lattice with two runs and on a cloud."""
    from catalogue import SCENARIO

    folder = tmp_path_factory.mktemp("figures")
    files = []
    for name, points, sweep in (
        # a parameter called as something that is followed through the frames
        ("regular", LATTICE, "sweep: {release.volume: [1, 2]}\n"),
        (
            "irregular",
            "{layout: poisson-disc, count: 300}",
            "sweep: {terrain.transition: [linear, quadratic]}\n",
        ),
    ):
        files.append(folder / f"{name}.yaml")
        files[-1].write_text(SCENARIO.format(name=name).replace(LATTICE, points).replace(*SHORT) + sweep)
    # a cloud whose profile differs between runs, by words
    files[-1].write_text(files[-1].read_text().replace(*BEND))
    command = [sys.executable, "-m", "pipeline"]
    done = [
        subprocess.run([*command, *arguments], capture_output=True, text=True, check=False)
        for arguments in (["run", *files, "--out", folder / "out"], ["figures", folder / "out"])
    ]
    return folder / "out", *done


def test_figures_and_table_are_drawn_from_stores_alone(place):
    out, ran, drew = place
    assert (ran.returncode, drew.returncode) == (0, 0), ran.stderr + drew.stderr
    assert "irregular: 297 points" in ran.stdout
    written = {path.name for path in (out / "figures").iterdir()}
    assert written == {
        "profile.png",
        "points.png",
        "depth-irregular-0.png",
        "depth-irregular-1.png",
        "depth-regular-0.png",
        "depth-regular-1.png",
        "volume-error.png",
        "comparison.csv",
        "comparison.md",
    }
    for path in (out / "figures").glob("*.png"):
        with Image.open(path) as picture:
            colours = picture.convert("RGB").getcolors(1 << 24)
        assert len(colours) > 20, f"{path.name} is empty"


def test_the_table_has_a_row_a_run(place):
    table = pd.read_csv(place[0] / "figures" / "comparison.csv")
    assert table["run"].tolist() == [
        "irregular: transition linear",
        "irregular: transition quadratic",
        "regular: volume 1 m³",
        "regular: volume 2 m³",
    ]
    # all of them still move at so early an end
    assert (table["status"] == "cut off").all()
    assert (table["time"] == 0.1).all()
    assert table["volume_error"].abs().max() < 1e-6
    assert (table["front_x"] > table["tail_x"] + 1).all()
    text = (place[0] / "figures" / "comparison.md").read_text()
    assert len(text.splitlines()) == 2 + len(table)


def test_a_place_without_stores_is_bad_input(tmp_path):
    command = [sys.executable, "-m", "pipeline", "figures", tmp_path]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert f"no results in {tmp_path}" in done.stderr
