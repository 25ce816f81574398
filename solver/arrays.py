"""Types of the arrays that kernels take."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
# numbers of cells and faces in the large tables of a cloud, whose size is what reading them costs
Numbers = NDArray[np.uint32]
