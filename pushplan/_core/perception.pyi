"""Rays of sensors, and maps of scans."""

from typing import Annotated

import numpy
from numpy.typing import NDArray


def cast_rays(lengths: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], x: float, y: float, heading: float, vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

def mark_scan(values: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], corner_x: float, corner_y: float, side: float, x: float, y: float, bearings: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], passed: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], hits: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], evidence: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], averaged: bool) -> tuple[int, int, int, int]: ...
