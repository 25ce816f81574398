import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

from pipeline.gis.symbology import CLASSES, of_values
from pipeline.report.figures import encoded
from pipeline.report.palette import with_palette

ENTRIES = (*CLASSES["hazard_level"], *of_values("share", "1", 1.0).entries)
COLOURS = [(255 * np.array(to_rgb(each.colour))).round() for each in ENTRIES]


def shaded(rows=160, columns=360):
    """A hillshade of all greys with classes over it as maps have them: solid, and as bands and edges are."""
    grey = np.add.outer(np.linspace(60, 160, rows), np.linspace(0, 90, columns))
    whole = np.repeat(grey[..., None], 3, axis=2)
    for number, colour in enumerate(COLOURS):
        part = whole[:, 30 * number : 30 * number + 20]
        part[:10] = colour
        for row, share in zip(range(40, rows, 15), (0.1, 0.2, 0.3, 0.45, 0.6, 0.7, 0.8, 0.9), strict=True):
            part[row : row + 10] = share * colour + (1 - share) * part[row : row + 10]
    return Image.fromarray(whole.round().astype(np.uint8))


def pixels(picture):
    return np.asarray(picture.convert("RGB")).astype(int)


def tint(colours):
    return colours - colours.mean(axis=-1, keepdims=True)


@pytest.mark.parametrize(("most", "near"), [(128, 20), (256, 12)])
def test_greys_stay_grey_and_colours_keep_their_hue(most, near):
    picture = shaded()
    assert len(picture.getcolors(1 << 24)) > 1000
    (reduced,) = with_palette([picture], most)
    before, after = pixels(picture), pixels(reduced)
    grey = np.ptp(before, axis=-1) == 0
    assert (np.ptp(after, axis=-1)[grey] == 0).all()
    assert (np.abs(tint(before) - tint(after)).max(axis=-1) > near).mean() < 1e-3
    assert np.abs(before - after).max() < 1.5 * near
    for number, colour in enumerate(COLOURS):
        assert (after[:10, 30 * number : 30 * number + 20] == colour).all()


def test_a_film_has_the_colours_of_every_picture(tmp_path):
    """A class that is there in one picture alone, as the deepest one at the start."""
    first = shaded()
    others = [Image.fromarray(np.full((160, 360, 3), 200, np.uint8))] * 4
    path = tmp_path / "film.gif"
    path.write_bytes(encoded([first, *others], "gif"))
    with Image.open(path) as film:
        assert np.abs(pixels(first) - pixels(film)).max() < 30
