"""The values of a raster of one band, in the unit that its scale and offset make."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

# what is told of a raster that opens and cannot be read
CUT_OFF = "which cannot be read to its end: it is cut off or damaged, copy it anew"


def scaled(values: NDArray[Any], source: Any) -> NDArray[np.float64]:
    """Give what values of the first band of an open raster stand for: scale times value and offset."""
    found: NDArray[np.float64] = values.astype(np.float64)
    scale, offset = source.scales[0], source.offsets[0]
    return found if (scale, offset) == (1.0, 0.0) else found * scale + offset
