"""Ice fields in files: JSON, and plain NumPy arrays. Pickles are never read."""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import ArrayLike

from pushplan.errors import short
from pushplan.files.safe_files import known_keys, name_unused, read_data, read_npy, read_npz
from pushplan.geometry import convex_penetration
from pushplan.scenarios.ice_field import IceField
from pushplan.world import InvalidInputError, SchemaError
from pushplan.world.checks import (
    FloatArray,
    IntArray,
    array,
    checked_bounds,
    choice,
    expect,
    number,
)
from pushplan.world.convex_shapes import hull_of, listed_corners, shapes_of
from pushplan.world.outline import ConvexParts, flatten, outline_boxes, transform
from pushplan.world.outline_repair import OutlineWarning

SCHEMA = "pushplan-ice/1"
"""Name and version of the JSON form; files of another version are refused."""
_MAX_BYTES = 10**8
ENDINGS = (".json", ".npz", ".npy")
_TOUCH_RADII = 1e-6  # depth to which floes may overlap: rounding, where they touch
_GAP_RADII = 1e-3  # that is left between floes that were moved apart; of the smaller one both
_MOST_TESTS = 300_000  # of pairs of parts, when floes are moved apart
_PATIENCE = 40  # rounds in which the deepest overlap has to become less,
_LESS = 0.99  # by this factor
_EDGES = ("bounds", "water")
_PLACED = ("location", "perimeter", "yaw", "type")
"""Keys of a floe of the National Research Council of Canada that are used."""
_WAY_ON = "overlaps=True (--overlaps, the variation ice_overlaps) leaves them as they are"


def load_ice(
    path: str | Path,
    *,
    hull: bool = False,
    overlaps: bool = False,
    within: ArrayLike | None = None,
    place: Callable[[FloatArray], FloatArray] | None = None,
) -> IceField:
    """Read an ice field.

    - ``.json``: a list of polygons, each a list of [x, y] corners [m]; or a mapping with
      ``polygons``, and ``schema`` and ``bounds`` or ``water`` if you like; or the fields of the
      National Research Council of Canada, a mapping with ``ice``, each floe of it with ``location``
      [x, y], ``perimeter``, the corners relative to it, and ``yaw``, their turn about it [degrees];
      ``field_size`` in its ``properties`` is the ``water``, from the origin on.
    - ``.npz``: arrays ``vertices`` (V, 2) [m] and ``offsets`` (K + 1,), where each floe starts in
      them and the last ends, and ``bounds`` or ``water`` if you like.
    - ``.npy``: an array (K, N, 2) of K floes with N corners each.

    Floes must lie within ``bounds``; they may reach across the edge of ``water``. An
    `UnusedInputWarning` names the keys of a floe or of ``properties`` that are not used.

    Floes need not be convex; a list of outlines in place of one is a floe of several parts. They
    are repaired and cut into convex parts as `pushplan.world.outline_repair.outline_parts` says.
    Those that overlap are moved apart: again and again each pair by the least translation that
    separates its deepest parts, the smaller floe more. An `OutlineWarning` says how far. Without
    bounds, the rectangle around all floes counts.

    Args:
        path: the file.
        hull: take the convex hull of a floe that is not convex.
        overlaps: leave floes that overlap where they are, as those of the 2D benchmark are.
        within: (4,) x_min, y_min, x_max, y_max to which floes may be moved [m]; the bounds that the
            file states if None, or else anywhere.
        place: gives the pose (3,) at which the field is put, for the water (4,) that a file states.

    Raises:
        SchemaError: if the file cannot be read or has another form.
        InvalidInputError: if a floe crosses itself, has no area or leaves the bounds, or if floes
            cannot be moved apart. Messages name the file, the polygon, counted from 0,
            and the rule.
    """
    path = _path(path)
    if path.suffix.lower() not in ENDINGS:
        raise InvalidInputError(
            f"an ice field is read from {', '.join(ENDINGS)} files (never from pickles), "
            f"got {str(path)!r}"
        )
    try:
        polygons, stated = _READERS[path.suffix.lower()](path)
    except SchemaError:
        raise
    except InvalidInputError as error:
        raise SchemaError(f"{path}: {error}") from error
    try:
        floes = _floes(polygons, hull)
        if stated.keys() >= {*_EDGES}:
            raise InvalidInputError("a field states its bounds or its water, got both")
        water = stated.get("water")
        room = stated.get("bounds", water)
        field = IceField(tuple(floes), _bounds(floes, room))
        if water is None:
            _check_inside(field)
        elif place is not None:
            field = _put(field, place(field.bounds))
        if not overlaps:
            room = room if within is None else within
            field = _apart(field, None if room is None else checked_bounds("within", room))
        return field
    except InvalidInputError as error:
        raise InvalidInputError(f"{path}: {error}") from error


def save_ice(field: IceField, path: str | Path) -> None:
    """Write a field to a ``.json`` or ``.npz`` file; `load_ice` gives it back equal.

    Raises:
        InvalidInputError: if the ending is another one, or the file cannot be written.
    """
    path = _path(path)
    ending = path.suffix.lower()
    edge = "water" if len(_outside(field)) else "bounds"
    try:
        if ending == ".json":
            data = {
                "schema": SCHEMA,
                edge: field.bounds.tolist(),
                "polygons": [listed_corners(parts) for parts in field.floes],
            }
            path.write_text(json.dumps(data) + "\n", encoding="utf-8")
        elif ending == ".npz":
            vertices, offsets = flatten([part for parts in field.floes for part in parts])
            arrays: dict[str, Any] = {
                "vertices": vertices,
                "offsets": offsets,
                edge: field.bounds,
            }
            if len(offsets) != len(field) + 1:
                arrays["first_parts"] = np.cumsum([0, *map(len, field.floes)])
            with path.open("wb") as file:
                np.savez_compressed(file, **arrays)
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


def _read_json(path: Path) -> tuple[Sequence[Any], Mapping[str, Any]]:
    data = read_data(path, "ice field")
    kind = f"ice field {path}"
    stated: Mapping[str, Any] = {}
    if isinstance(data, Mapping) and "ice" in data:
        return _placed(kind, known_keys(kind, data, ("ice", "properties"), ("ice",)))
    if isinstance(data, Mapping):
        stated = known_keys(kind, data, ("schema", "polygons", *_EDGES), ("polygons",))
        if data.get("schema", SCHEMA) != SCHEMA:
            raise SchemaError(
                f"{path}: this pushplan reads schema {SCHEMA!r}, got {short(data['schema'])}"
            )
        data = data["polygons"]
    if not isinstance(data, list):
        raise SchemaError(f"{path}: polygons must be a list of lists of corners, got {short(data)}")
    return data, stated


def _placed(kind: str, data: Mapping[str, Any]) -> tuple[list[FloatArray], Mapping[str, Any]]:
    """Outlines that are stated relative to a place and a heading each, and their water."""
    polygons = []
    keys = set[str]()
    for name, floe in expect("ice", data["ice"], dict).items():
        called = f"floe {name!r:.20}"
        keys.update(known_keys(called, floe, None, _PLACED[:2]))
        choice(f"type of {called}", floe.get("type", "polygon"), ("polygon",))
        place = array(f"location of {called}", floe["location"], (2,))
        turn = math.radians(number(f"yaw of {called}", floe.get("yaw", 0.0)))
        corners = array(f"perimeter of {called}", floe["perimeter"], (None, 2))
        polygons.append(transform([*place, turn], corners))
    properties = known_keys("properties", data.get("properties", {}), None, ())
    unused = {f"properties.{key}" for key in properties.keys() - {"field_size"}}
    name_unused(kind, unused | {f"floes.{key}" for key in keys - {*_PLACED}})
    if "field_size" not in properties:
        return polygons, {}
    size = array("field_size", properties["field_size"], (2,))
    return polygons, {"water": [0.0, 0.0, *size]}


def _read_npz(path: Path) -> tuple[Sequence[Any], Mapping[str, Any]]:
    optional = (*_EDGES, "first_parts")
    arrays = read_npz(path, "ice field", ("vertices", "offsets"), optional, _MAX_BYTES)
    vertices = array("vertices", arrays["vertices"], (None, 2))
    parts = _groups(path, "offsets", arrays["offsets"], vertices, "vertices")
    if "first_parts" not in arrays:
        return parts, arrays
    return _groups(path, "first_parts", arrays["first_parts"], parts, "parts"), arrays


def _groups(path: Path, name: str, starts: Any, items: Any, what: str) -> list[Any]:
    """Consecutive items, grouped by where each group starts."""
    offsets: IntArray = array(name, starts, (None,), dtype=np.int64)
    rises = len(offsets) > 0 and offsets[0] == 0 and (np.diff(offsets) >= 0).all()
    if not rises or offsets[-1] != len(items):
        raise SchemaError(
            f"{path}: {name} must rise from 0 to the number of {what}, {len(items)}, "
            f"got {offsets.tolist()!s:.60}"
        )
    return [items[a:b] for a, b in pairwise(offsets.tolist())]


def _read_npy(path: Path) -> tuple[Sequence[Any], Mapping[str, Any]]:
    data = read_npy(path, "ice field")
    polygons: FloatArray = array("the array of polygons", data, (None, None, 2))
    return list(polygons), {}


_READERS = {".json": _read_json, ".npz": _read_npz, ".npy": _read_npy}


def _floes(polygons: Sequence[Any], hull: bool) -> list[ConvexParts]:
    floes = shapes_of("polygon", polygons, smooth=True)
    if not hull:
        return floes
    return [(hull_of(parts),) for parts in floes]


def _bounds(floes: Sequence[ConvexParts], bounds: object) -> FloatArray:
    if bounds is not None:
        return checked_bounds("ice bounds", bounds)
    if not floes:
        raise InvalidInputError("an ice field without floes must state its bounds")
    boxes = _boxes(floes)
    return checked_bounds("ice bounds", [*boxes[:, :2].min(axis=0), *boxes[:, 2:].max(axis=0)])


def _boxes(floes: Sequence[ConvexParts]) -> FloatArray:
    """(K, 4) x_min, y_min, x_max, y_max [m] of the floes."""
    return outline_boxes(*flatten([np.concatenate(parts) for parts in floes]))


def _outside(field: IceField) -> IntArray:
    """Numbers of the floes that do not lie within the bounds."""
    slack = 1e-9 * float((field.bounds[2:] - field.bounds[:2]).max())
    boxes = _boxes(field.floes)
    within = (boxes[:, :2] >= field.bounds[:2] - slack) & (boxes[:, 2:] <= field.bounds[2:] + slack)
    return np.flatnonzero(~within.all(axis=1))


def _check_inside(field: IceField) -> None:
    for i in _outside(field).tolist():
        (box,) = _boxes(field.floes[i : i + 1])
        raise InvalidInputError(
            f"polygon {i} must lie within the bounds {field.bounds.tolist()}, "
            f"it reaches from {box[:2].tolist()} to {box[2:].tolist()}"
        )


def _put(field: IceField, pose: FloatArray) -> IceField:
    """The field at a pose (3,), a multiple of quarter turns."""
    floes = [tuple(transform(pose, part) for part in parts) for parts in field.floes]
    corners = transform(pose, field.bounds.reshape(2, 2))
    return IceField(tuple(floes), np.concatenate([corners.min(axis=0), corners.max(axis=0)]))


def _apart(field: IceField, room: FloatArray | None) -> IceField:
    """The field with overlapping floes moved apart, within a rectangle (4,) [m] if there is one."""
    boxes = _boxes(field.floes)
    shifts = np.zeros((len(field), 2))
    tests, pairs = _overlaps(field, shifts)
    if not pairs:
        return field
    if room is not None and field.areas.sum() > np.prod(room[2:] - room[:2]):
        raise InvalidInputError(
            f"floes must not overlap: they have {field.areas.sum():.3g} m² in all, in "
            f"{np.prod(room[2:] - room[:2]):.3g} m² of water; {_WAY_ON}"
        )
    first_count = len(pairs)
    depths = [max(pair.depth for pair in pairs)]
    while pairs and tests < _MOST_TESTS and _decreases(depths):
        for a, b, depth, normal in pairs:
            share = field.areas[b] / (field.areas[a] + field.areas[b])
            way = (depth + _GAP_RADII * min(field.radii[a], field.radii[b])) * normal
            shifts[a] -= share * way
            shifts[b] += (1.0 - share) * way
        if room is not None:
            # a floe that reaches across the edge may stay as far out as it is
            least = np.minimum(room[:2] - boxes[:, :2], 0.0)
            most = np.maximum(room[2:] - boxes[:, 2:], 0.0)
            shifts = np.clip(shifts, least, most)
        count, pairs = _overlaps(field, shifts)
        tests += count
        depths.append(max((pair.depth for pair in pairs), default=0.0))
    if pairs:
        worst = max(pairs, key=attrgetter("depth"))
        raise InvalidInputError(
            f"floes must not overlap, and could not be moved apart: of {len(pairs)} pairs, "
            f"polygons {worst.first} and {worst.second} still overlap by {worst.depth:.3g} m; "
            f"{_WAY_ON}"
        )
    moved = (shifts != 0.0).any(axis=1)
    warnings.warn(
        f"floes overlapped in {first_count} places: {int(moved.sum())} of {len(field)} floes were "
        f"moved apart by at most {np.hypot(*shifts.T).max():.3g} m",
        OutlineWarning,
        stacklevel=3,
    )
    floes = [
        tuple(part + shift for part in parts)
        for parts, shift in zip(field.floes, shifts, strict=True)
    ]
    return IceField(tuple(floes), _bounds(floes, None if room is None else field.bounds))


def _decreases(depths: list[float]) -> bool:
    """True if the last rounds have brought the deepest overlap below all before, or are few."""
    before = min(depths[:-_PATIENCE], default=math.inf)
    return min(depths[-_PATIENCE:]) < _LESS * before


class _Overlap(NamedTuple):
    first: int
    second: int
    depth: float  # [m]
    normal: FloatArray  # (2,) unit, the way out for the second


def _overlaps(field: IceField, shifts: FloatArray) -> tuple[int, list[_Overlap]]:
    """Count tests of parts, and find the deepest overlap of each pair of shifted floes."""
    parts = [part + shifts[k] for k, floe in enumerate(field.floes) for part in floe]
    owners = np.repeat(np.arange(len(field)), [len(floe) for floe in field.floes])
    low_x, low_y, high_x, high_y = outline_boxes(*flatten(parts)).T
    tree = shapely.STRtree(shapely.box(low_x, low_y, high_x, high_y))
    first, second = tree.query(tree.geometries, predicate="intersects")
    near = owners[first] < owners[second]
    found: dict[tuple[int, int], _Overlap] = {}
    for i, j in zip(first[near].tolist(), second[near].tolist(), strict=True):
        a, b = int(owners[i]), int(owners[j])
        depth, *normal = convex_penetration(parts[i], parts[j])
        if depth > _TOUCH_RADII * min(field.radii[a], field.radii[b]):
            deepest = found.get((a, b))
            if deepest is None or depth > deepest.depth:
                found[a, b] = _Overlap(a, b, depth, np.array(normal))
    return int(near.sum()), list(found.values())
