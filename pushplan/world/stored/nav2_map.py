"""Maps of ROS's ``map_server`` and Nav2: a YAML file that names a picture."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np

from pushplan.errors import InvalidInputError, SchemaError, describe, short
from pushplan.files.safe_files import known_keys, name_unused, read_bytes, read_data
from pushplan.imports.on_demand import need
from pushplan.world.checks import (
    BoolArray,
    FloatArray,
    IntArray,
    array,
    choice,
    number,
    word,
)
from pushplan.world.static_map import StaticMap

_DEPTH = re.compile(rb"P[25](?:\s+(?:#.*\s+)*\d+){2}\s+(?:#.*\s+)*(\d+)")
"""Greatest value of a grey map in PGM."""
_MODES = ("trinary", "scale", "raw")
_FORMATS = ("PPM", "PNG", "BMP", "JPEG")
_MAX_PIXELS = 4096**2
_TO_16_BITS = 257
"""Factor from a value of 8 bits to one of 16: 65535 / 255."""
_LUMA = np.array([299, 587, 114])
"""Weights of red, green and blue in a grey value [1/1000], ITU-R BT.601."""
_REQUIRED = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")


def load_nav2_map(path: str | Path, *, unknown: str = "obstacle", occupied: int = 65) -> StaticMap:
    """Read a map as ``nav2_map_server`` does, from its YAML file.

    Args:
        path: the YAML file, which names a picture (PGM, PNG, BMP, JPEG) beside it.
        unknown: "obstacle" or "free", what unknown cells count as.
        occupied: cells from this value on are obstacles [%]; in maps of mode ``trinary`` a cell is
            0, 100 or unknown.

    Raises:
        SchemaError: if a file is missing or cannot be read, or a key is missing or unknown.
        InvalidInputError: if a value breaks its rule.
        MissingDependencyError: if Pillow is not installed.
    """
    grid, resolution, origin = read_nav2_grid(path)
    return StaticMap.from_occupancy(grid, resolution, origin, occupied=occupied, unknown=unknown)


def read_nav2_grid(path: str | Path) -> tuple[IntArray, float, FloatArray]:
    """The occupancy grid of a map: what ``nav2_map_server`` would publish for it.

    Thresholds, modes and opacity have the meaning of ``map_io.cpp`` from Nav2 Jazzy on. Keys that


    Returns:
        (rows, columns) -1 or 0 to 100, row 0 at the least y; the side of a cell [m]; (3,) x, y
        [m] and theta [rad] of the corner of cell (0, 0).

    Raises:
        As `load_nav2_map`.
    """
    data = read_data(path, "map file")
    path = Path(path)
    try:
        known_keys("map file", data, None, _REQUIRED)
        name_unused(f"map file {path}", data.keys() - {*_REQUIRED, "mode"})
        mode = choice("map mode", word("mode", data.get("mode", "trinary")).lower(), _MODES)
        negate = data["negate"]
        if negate not in (0, 1):
            raise InvalidInputError(f"negate must be 0 or 1, got {short(negate)}")
        high = number("occupied_thresh", data["occupied_thresh"], low=0.0, high=1.0)
        low = number("free_thresh", data["free_thresh"], low=0.0, high=1.0)
        if low > high:
            rule = f"must not be above occupied_thresh, got {low:g} and {high:g}"
            raise InvalidInputError(f"free_thresh {rule}")
        side = number("resolution", data["resolution"], low=0.0, open_low=True)
        origin: FloatArray = array("origin", data["origin"], (3,))
        grey, opaque = _picture(path.parent / word("image", data["image"]))
    except InvalidInputError as error:
        raise type(error)(f"{path}: {error}") from error
    if mode == "raw":  # the grid itself, in percent; all else is unknown
        cells = np.where(grey <= 100, grey, -1)
    else:
        cells = _compared(grey, bool(negate), low, high, mode == "scale")
        cells[~opaque] = -1
    upwards = cells[::-1]  # a picture begins with its top row, a grid with the lowest
    return np.ascontiguousarray(upwards.astype(np.int64)), side, origin


def _compared(grey: IntArray, negate: bool, low: float, high: float, scale: bool) -> IntArray:
    """Cells by two thresholds that belong to the values they bound, in float32 as Nav2 does."""
    shade = grey.astype(np.float32) / np.float32(255.0)
    taken = shade if negate else np.float32(1.0) - shade
    least = np.float32(low)
    most = np.float32(high)
    width = np.float32(high - low)
    cells = np.full(grey.shape, -1)
    if scale and width > 0.0:
        between = (taken - least) / width * np.float32(100.0)
        cells = np.floor(between.astype(np.float64) + 0.5).astype(np.int64)
    cells[taken >= most] = 100
    cells[taken <= least] = 0  # wins where the thresholds are equal
    return cells


def _picture(path: Path) -> tuple[IntArray, BoolArray]:
    """Grey values 0 to 255 and the opaque pixels, (rows, columns) each, top row first."""
    Image = need("PIL.Image")
    data = read_bytes(path, "the picture of the map,")
    try:
        with Image.open(io.BytesIO(data), formats=_FORMATS) as image:
            if image.width * image.height > _MAX_PIXELS:
                raise ValueError(f"{image.width} x {image.height} pixels, {_MAX_PIXELS:,} are most")
            grey, opaque = _pixels(image)
    except Exception as error:  # a decoder of pictures raises errors of many kinds
        why = describe(error)
        if isinstance(error, Image.UnidentifiedImageError):
            why = "it is no whole picture in PGM, PNG, BMP or JPEG"
        raise SchemaError(f"cannot read the picture of the map, {path}: {why}") from error
    depth = _DEPTH.match(data)
    if depth is not None and 0 < int(depth[1]) < 255:  # Pillow rounds to the nearest
        most = int(depth[1])
        grey = np.rint(grey * (most / 255.0)).astype(np.int64) * (65535 // most) // _TO_16_BITS
    return grey, opaque


def _pixels(image: Any) -> tuple[IntArray, BoolArray]:
    """Convert an image to `_picture`'s result like GraphicsMagick: in 16 bits, then down to 8."""
    hidden = image.info.get("transparency")
    if image.mode.startswith("I"):  # 16 bits of grey
        deep = np.asarray(image, dtype=np.int64)
        shown = np.full(deep.shape, True)
        if hidden is not None:
            shown = deep != hidden
        return deep // _TO_16_BITS, shown
    wanted = "RGB"
    if hidden is not None or image.mode in ("LA", "RGBA", "PA"):
        wanted = "RGBA"
    pixels = np.asarray(image.convert(wanted), dtype=np.int64)
    grey = (_TO_16_BITS * pixels[..., :3] @ _LUMA + 500) // 1000 // _TO_16_BITS
    return grey, pixels[..., 3:].min(axis=2, initial=255) == 255
