"""Ice fields in files: JSON, and plain NumPy arrays. Pickles are never read."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike

from pushplan.errors import short
from pushplan.files.safe_files import known_keys, read_data, read_npy, read_npz
from pushplan.scenarios.ice_field import IceField
from pushplan.world import InvalidInputError, SchemaError
from pushplan.world.checks import (
    FloatArray,
    array,
    checked_bounds,
    expect,
)
from pushplan.world.outline import (
    NotConvexError,
    convex_hull,
    convex_outline,
    convex_outlines,
    flatten,
    unflatten,
)

SCHEMA = "pushplan-ice/1"
"""Name and version of the JSON form; files of another version are refused."""
_MAX_BYTES = 10**8
ENDINGS = (".json", ".npz", ".npy")
_OVERLAP = 1e-6  # floes may overlap by this fraction of the smaller one: rounding, where they touch


def load_ice(path: str | Path, *, hull: bool = False, overlaps: bool = False) -> IceField:
    """Read an ice field.

    - ``.json``: a list of polygons, each a list of [x, y] corners [m]; or a mapping with
      ``polygons``, and ``bounds`` and ``schema`` if you like; or the fields of the National
      Research Council of Canada, a mapping with ``ice``, each floe of it with ``location`` [x, y]
      and ``perimeter``, the corners relative to it.
    - ``.npz``: arrays ``vertices`` (V, 2) [m] and ``offsets`` (K + 1,), where each floe starts in
      them and the last ends, and ``bounds`` if you like.
    - ``.npy``: an array (K, N, 2) of K floes with N corners each.

    Outlines are checked as `pushplan.world.outline.convex_outline` does. Without bounds, the
    rectangle around all floes counts.

    Args:
        path: the file.
        hull: take the convex hull of a floe that is not convex, instead of refusing it.
        overlaps: take floes that overlap, as those of the 2D benchmark do and hulls of floes that
            a camera sees, instead of refusing them.

    Raises:
        SchemaError: if the file cannot be read or has another form.
        InvalidInputError: if a floe is not convex, has no area or leaves the bounds, or if two
            floes overlap. Messages name the file, the polygon, counted from 0, and the rule.
    """
    path = _path(path)
    if path.suffix.lower() not in ENDINGS:
        raise InvalidInputError(
            f"an ice field is read from {', '.join(ENDINGS)} files (never from pickles), "
            f"got {str(path)!r}"
        )
    try:
        polygons, bounds = _READERS[path.suffix.lower()](path)
    except SchemaError:
        raise
    except InvalidInputError as error:
        raise SchemaError(f"{path}: {error}") from error
    try:
        floes = _clean(polygons, hull)
        field = IceField(floes, _bounds(floes, bounds))
        _check_inside(field)
        if not overlaps:
            _check_apart(field)
    except InvalidInputError as error:
        raise InvalidInputError(f"{path}: {error}") from error
    return field


def save_ice(field: IceField, path: str | Path) -> None:
    """Write a field to a ``.json`` or ``.npz`` file; `load_ice` gives it back equal.

    Raises:
        InvalidInputError: if the ending is another one, or the file cannot be written.
    """
    path = _path(path)
    ending = path.suffix.lower()
    try:
        if ending == ".json":
            data = {
                "schema": SCHEMA,
                "bounds": field.bounds.tolist(),
                "polygons": [corners.tolist() for corners in field.polygons],
            }
            path.write_text(json.dumps(data) + "\n", encoding="utf-8")
        elif ending == ".npz":
            vertices, offsets = flatten(field.polygons)
            with path.open("wb") as file:
                np.savez_compressed(file, vertices=vertices, offsets=offsets, bounds=field.bounds)
        else:
            raise InvalidInputError(
                f"an ice field is written to a .json or .npz file, got {str(path)!r}"
            )
    except OSError as error:
        raise InvalidInputError(f"cannot write {path}: {error}") from error


def _path(path: object) -> Path:
    if not isinstance(path, str | Path):
        raise InvalidInputError(f"the path of an ice field must be a text, got {path!r:.60}")
    return Path(path)


def _read_json(path: Path) -> tuple[Sequence[Any], object]:
    data = read_data(path, "ice field")
    bounds: object = None
    if isinstance(data, Mapping) and "ice" in data:
        known_keys(f"ice field {path}", data, ("ice", "properties"), ("ice",))
        return _placed(data["ice"]), None
    if isinstance(data, Mapping):
        known_keys(f"ice field {path}", data, ("schema", "bounds", "polygons"), ("polygons",))
        if data.get("schema", SCHEMA) != SCHEMA:
            raise SchemaError(
                f"{path}: this pushplan reads schema {SCHEMA!r}, got {short(data['schema'])}"
            )
        bounds = data.get("bounds")
        data = data["polygons"]
    if not isinstance(data, list):
        raise SchemaError(f"{path}: polygons must be a list of lists of corners, got {short(data)}")
    return data, bounds


def _placed(floes: object) -> list[FloatArray]:
    """Outlines that are stated relative to a place each."""
    polygons = []
    for name, floe in expect("ice", floes, dict).items():
        known_keys(f"floe {name!r:.20}", floe, None, ("location", "perimeter"))
        place = array(f"location of floe {name!r:.20}", floe["location"], (2,))
        corners = array(f"perimeter of floe {name!r:.20}", floe["perimeter"], (None, 2))
        polygons.append(corners + place)
    return polygons


def _read_npz(path: Path) -> tuple[Sequence[Any], object]:
    arrays = read_npz(path, "ice field", ("vertices", "offsets"), ("bounds",), _MAX_BYTES)
    vertices = array("vertices", arrays["vertices"], (None, 2))
    offsets = array("offsets", arrays["offsets"], (None,), dtype=np.int64)
    if (
        len(offsets) == 0
        or offsets[0] != 0
        or offsets[-1] != len(vertices)
        or (np.diff(offsets) < 0).any()
    ):
        raise SchemaError(
            f"{path}: offsets must rise from 0 to the number of vertices, {len(vertices)}, "
            f"got {offsets.tolist()!s:.60}"
        )
    return unflatten(vertices, offsets), arrays.get("bounds")


def _read_npy(path: Path) -> tuple[Sequence[Any], object]:
    data = read_npy(path, "ice field")
    polygons: FloatArray = array("the array of polygons", data, (None, None, 2))
    return list(polygons), None


_READERS = {".json": _read_json, ".npz": _read_npz, ".npy": _read_npy}


def _clean(polygons: Sequence[Any], hull: bool) -> tuple[FloatArray, ...]:
    """Convex outlines; of others the hulls where that is asked for."""
    if hull:
        return tuple(_or_hull(f"polygon {i}", corners) for i, corners in enumerate(polygons))
    try:
        return tuple(convex_outlines("polygon", polygons))
    except NotConvexError as error:
        way_on = "hull=True (--hull, the variation ice_hull) takes its convex hull"
        raise InvalidInputError(f"{error}; {way_on}") from error


def _or_hull(name: str, corners: ArrayLike) -> FloatArray:
    try:
        return convex_outline(name, corners)
    except InvalidInputError:
        return convex_outline(name, convex_hull(array(name, corners, (None, 2))))


def _bounds(floes: Sequence[FloatArray], bounds: object) -> FloatArray:
    if bounds is not None:
        return checked_bounds("ice bounds", bounds)
    if not floes:
        raise InvalidInputError("an ice field without floes must state its bounds")
    corners = np.concatenate(floes)
    return checked_bounds("ice bounds", [*corners.min(axis=0), *corners.max(axis=0)])


def _check_inside(field: IceField) -> None:
    slack = 1e-9 * float((field.bounds[2:] - field.bounds[:2]).max())
    for i, corners in enumerate(field.polygons):
        if (corners < field.bounds[:2] - slack).any() or (corners > field.bounds[2:] + slack).any():
            raise InvalidInputError(
                f"polygon {i} must lie within the bounds {field.bounds.tolist()}, "
                f"got {corners.tolist()!s:.80}"
            )


def _check_apart(field: IceField) -> None:
    """Refuse floes that overlap; touching is fine."""
    shapes = np.array([shapely.Polygon(corners) for corners in field.polygons], dtype=object)
    first, second = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    first, second = first[first < second], second[first < second]
    shared = shapely.area(shapely.intersection(shapes[first], shapes[second]))
    bad = shared > _OVERLAP * np.minimum(field.areas[first], field.areas[second])
    if bad.any():
        worst = int(np.argmax(np.where(bad, shared, 0.0)))
        raise InvalidInputError(
            f"floes must not overlap: polygons {first[worst]} and {second[worst]} share "
            f"{shared[worst]:.3g} m², the most of {int(bad.sum())} pairs; overlaps=True "
            "(--overlaps, the variation ice_overlaps) takes them so"
        )
