"""The messages of the protocol, described in docs/serve.md.

A message is a length (4 bytes, big-endian) and as many bytes of JSON: a mapping whose key ``type``
says what it is. Every request gets one reply, in order.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from typing import Any

from pushplan.errors import one_line, short, unknown_name_message
from pushplan.files.safe_files import known_keys, parse_json
from pushplan.world import Plan, SchemaError

PROTOCOL = "pushplan-serve/1"
"""Name and version; a client of another version is refused."""
LENGTH = struct.Struct(">I")

CHANGES = ("time", "robot_pose", "robot_twist", "ids", "poses", "twists", "added")
"""Keys of a world of which a message says only what has changed."""
_WORLD = ("world", *CHANGES)
REQUESTS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "hello": (("protocol",), ("robot", "period", "settings")),
    "reset": (("world",), ("seed",)),
    "act": ((), (*_WORLD, "with_plan")),
    "start": (("world",), ("with_plan",)),
    "update": ((), _WORLD),
    "command": (("now",), ("with_plan",)),
    "cancel": ((), ("reason",)),
    "close": ((), ()),
}
"""Type -> keys that it must have, keys that it may have."""


def decode(body: bytes) -> dict[str, Any]:
    """The request in the body of a message, with known keys; their values are not looked at.

    Raises:
        SchemaError: if it is not JSON within the limits of `parse_json`, or no request.
    """
    try:
        text = body.decode("utf-8")
    except UnicodeDecodeError as error:
        raise SchemaError(f"a message is JSON in UTF-8: {error}") from error
    data = parse_json(text, "message")
    if not isinstance(data, dict):
        raise SchemaError(f"a message must be a mapping, got {short(data)}")
    kind = data.get("type")
    if not isinstance(kind, str) or kind not in REQUESTS:
        raise SchemaError(unknown_name_message("message type", kind, REQUESTS))
    required, optional = REQUESTS[kind]
    known_keys(f"message {kind!r}", data, ("type", *required, *optional), required)
    return data


def encode(message: Mapping[str, Any]) -> bytes:
    """A message as it is sent."""
    body = json.dumps(message, separators=(",", ":"), allow_nan=False).encode("ascii")
    return LENGTH.pack(len(body)) + body


def error(message: str, request: str | None = None, *, closing: bool = False) -> bytes:
    """An error as it is sent.

    Args:
        message: what is wrong; put on one line of 300 characters at most.
        request: type of the message that is wrong, if it is known.
        closing: the server ends the connection.
    """
    return encode(
        {"type": "error", "message": one_line(message), "request": request, "closing": closing}
    )


def plan_fields(plan: Plan | None) -> dict[str, Any] | None:
    """A plan as it is sent: the fields of `pushplan.world.Plan` as lists."""
    if plan is None:
        return None
    arrays = ("times", "poses", "speeds", "turn_rates")
    return {
        **{key: getattr(plan, key).tolist() for key in arrays},
        "travel_cost": plan.travel_cost,
        "interaction_cost": plan.interaction_cost,
        "subtasks": [
            {
                "object_ids": [int(i) for i in task.object_ids],
                "first": task.first,
                "last": task.last,
            }
            for task in plan.subtasks
        ],
    }
