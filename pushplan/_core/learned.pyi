"""What learned policies observe."""

from typing import Annotated

import numpy
from numpy.typing import NDArray


def cast_rays(lengths: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], x: float, y: float, heading: float, vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...
