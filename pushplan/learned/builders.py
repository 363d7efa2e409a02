"""Dataclasses and observation builders as plain data, so that they can travel with a network."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, asdict, fields
from typing import Any

from pushplan.files.safe_files import known_keys
from pushplan.learned.features import FeatureObservation
from pushplan.observation import ImageObservation, ObservationBuilder, StateObservation
from pushplan.perception import LidarObservation
from pushplan.world import InvalidInputError, SchemaError
from pushplan.world.checks import choice

KINDS: dict[str, type[Any]] = {
    "image": ImageObservation,
    "state": StateObservation,
    "features": FeatureObservation,
    "lidar": LidarObservation,
}
GREATEST_SIZE = 2**24
"""Elements of an observation that a file may ask for."""


def from_mapping(kind: type[Any], name: str, data: Any, *, beside: Sequence[str] = ()) -> Any:
    """A dataclass from a mapping of its fields, in which lists stand for tuples.

    Args:
        kind: the dataclass.
        name: what errors call the mapping.
        data: the mapping.
        beside: keys that may be there too; they are not used.

    Raises:
        SchemaError, InvalidInputError: if a key or a value is wrong.
    """
    own = [field.name for field in fields(kind)]
    needed = [
        field.name
        for field in fields(kind)
        if field.default is MISSING and field.default_factory is MISSING
    ]
    known_keys(name, data, (*beside, *own), needed)
    return kind(
        **{
            key: tuple(value) if isinstance(value, list) else value
            for key, value in data.items()
            if key in own
        }
    )


def builder_to_dict(builder: ObservationBuilder) -> dict[str, Any]:
    """JSON values from which `builder_from_dict` makes the builder again.

    Raises:
        InvalidInputError: if it is a builder of one's own, which a file cannot describe.
    """
    for kind, known in KINDS.items():
        if type(builder) is known:
            data = asdict(builder) | {"shape": builder.shape}  # type: ignore[call-overload]
            own: dict[str, Any] = json.loads(json.dumps(data))  # tuples as lists
            return {"kind": kind, **own, "dtype": builder.dtype.name}
    raise InvalidInputError(
        f"an observation in a file is one of {', '.join(KINDS)}, got {type(builder).__name__}"
    )


def builder_from_dict(data: Mapping[str, Any]) -> ObservationBuilder:
    """The builder of an observation.

    ``shape`` and ``dtype`` may be given, and must then be what the builder has.

    Raises:
        SchemaError, InvalidInputError: if a key or a value is wrong.
    """
    if not isinstance(data, Mapping) or "kind" not in data:
        raise SchemaError(f"observation must be a mapping with a kind, got {data!r:.80}")
    kind = KINDS[choice("observation kind", data["kind"], tuple(KINDS))]
    builder: ObservationBuilder = from_mapping(
        kind, "observation", data, beside=("kind", "shape", "dtype")
    )
    if math.prod(builder.shape) > GREATEST_SIZE:
        raise InvalidInputError(f"an observation of shape {builder.shape} is too large")
    shape = data.get("shape", builder.shape)
    dtype = data.get("dtype")
    if isinstance(shape, list):
        shape = tuple(shape)
    if shape != builder.shape or dtype not in (None, builder.dtype.name):
        raise SchemaError(
            f"observation says {dtype!s:.40} of shape {shape!s:.60}, but {data['kind']} "
            f"with these options is {builder.dtype.name} of shape {builder.shape}"
        )
    return builder
