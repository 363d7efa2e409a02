"""Maps of ROS's ``map_server`` and Nav2: a YAML file that names a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from pushplan.world.checks import FloatArray, IntArray, array, choice, known_keys, number
from pushplan.world.errors import InvalidInputError, SchemaError
from pushplan.world.libraries import need
from pushplan.world.static_map import StaticMap

_MODES = ("trinary", "scale", "raw")
_REQUIRED = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")


def load_nav2_map(path: str | Path, *, unknown: str = "obstacle", occupied: int = 65) -> StaticMap:
    """Read a map as ``nav2_map_server`` does, from its YAML file.

    Args:
        path: the YAML file, which names a picture (PGM, PNG, BMP) beside it.
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

    Its thresholds, modes and treatment of transparency are those of ``nav2_map_server``'s
    ``map_io.cpp``.

    Returns:
        (rows, columns) -1 or 0 to 100, row 0 at the least y; the side of a cell [m]; (3,) x, y
        [m] and theta [rad] of the corner of cell (0, 0).

    Raises:
        As `load_nav2_map`.
    """
    path = Path(path)
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise SchemaError(f"cannot read map file {path}: {' '.join(str(error).split())}") from error
    try:
        known_keys("map file", data, (*_REQUIRED, "mode"), _REQUIRED)
        mode = choice("map mode", data.get("mode", "trinary"), _MODES)
        negate = data["negate"]
        if negate not in (0, 1):
            raise InvalidInputError(f"negate must be 0 or 1, got {negate!r}")
        high = number("occupied_thresh", data["occupied_thresh"], low=0.0, high=1.0)
        low = number("free_thresh", data["free_thresh"], low=0.0, high=1.0)
        if low >= high:
            raise InvalidInputError(f"free_thresh must be below occupied_thresh, got {low}, {high}")
        side = number("resolution", data["resolution"], low=0.0, open_low=True)
        origin: FloatArray = array("origin", data["origin"], (3,))
        shade, alpha = _picture(path.parent / str(data["image"]))
    except SchemaError as error:
        raise SchemaError(f"{path}: {error}") from error
    except InvalidInputError as error:
        raise InvalidInputError(f"{path}: {error}") from error
    if mode == "raw":
        percent = np.floor(255.0 * shade + 0.5)
        cells = np.where(percent <= 100.0, percent, -1.0)
    else:
        if mode == "trinary" and alpha is not None:
            shade = (3.0 * shade + alpha) / 4.0  # as it always did
        taken = shade if negate else 1.0 - shade
        between = np.full(taken.shape, -1.0)
        if mode == "scale":
            between = np.rint((taken - low) / (high - low) * 100.0)
        cells = np.where(taken > high, 100.0, np.where(taken < low, 0.0, between))
        if mode == "scale" and alpha is not None:
            cells[alpha < 1.0] = -1.0
    return np.ascontiguousarray(cells[::-1].astype(np.int64)), side, origin


def _picture(path: Path) -> tuple[FloatArray, FloatArray | None]:
    """Mean of the colours (rows, columns) in [0, 1], top row first, and opacity where there is."""
    Image = need("PIL.Image")
    try:
        with Image.open(path) as image:
            pixels: Any = _pixels(image)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise SchemaError(f"cannot read the picture of the map, {path}: {error}") from error
    if pixels.ndim == 2:
        return pixels, None
    opaque = pixels[..., -1] if pixels.shape[2] in (2, 4) else None
    colours = pixels if opaque is None else pixels[..., :-1]
    return colours.mean(axis=2), opaque


def _pixels(image: Any) -> FloatArray:
    """Channels of a picture in [0, 1]: (rows, columns), or (rows, columns, channels)."""
    if image.mode.startswith("I"):  # 16 bits of grey
        return np.asarray(image, dtype=np.float64) / 65535.0
    if image.mode == "1":
        image = image.convert("L")
    elif image.mode not in ("L", "LA", "RGB", "RGBA"):
        image = image.convert("RGBA" if "transparency" in image.info else "RGB")
    return np.asarray(image, dtype=np.float64) / 255.0
