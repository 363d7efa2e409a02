"""Worlds drawn into images."""

from typing import Annotated

import numpy
from numpy.typing import NDArray


def to_pixels(view: Annotated[NDArray[numpy.float64], dict(shape=(7), order='C', device='cpu', writable=False)], points: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], out: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu')]) -> None: ...

def fill_parts(image: Annotated[NDArray[numpy.uint8], dict(shape=(None, None), order='C', device='cpu')], view: Annotated[NDArray[numpy.float64], dict(shape=(7), order='C', device='cpu', writable=False)], vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], value: int) -> None: ...

def fill_bodies(image: Annotated[NDArray[numpy.uint8], dict(shape=(None, None), order='C', device='cpu')], view: Annotated[NDArray[numpy.float64], dict(shape=(7), order='C', device='cpu', writable=False)], poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], radii: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], value: int) -> None: ...

def sample(image: Annotated[NDArray[numpy.uint8], dict(shape=(None, None), order='C', device='cpu')], view: Annotated[NDArray[numpy.float64], dict(shape=(7), order='C', device='cpu', writable=False)], values: Annotated[NDArray[numpy.uint8], dict(shape=(None, None), order='C', device='cpu', writable=False)], x: float, y: float, step: float) -> None: ...

def fill_hidden(image: Annotated[NDArray[numpy.uint8], dict(shape=(None, None), order='C', device='cpu')], view: Annotated[NDArray[numpy.float64], dict(shape=(7), order='C', device='cpu', writable=False)], x: float, y: float, loops: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], table: Annotated[NDArray[numpy.float32], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], origin: Annotated[NDArray[numpy.float64], dict(shape=(2), order='C', device='cpu', writable=False)], step: float, bends: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], lengths: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], per_metre: float) -> None: ...
