"""`ServerLimits`: what clients of a server may take."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from pushplan.world.checked_fields import CheckedFields, Limits, PositiveFloat


@dataclass(frozen=True)
class ServerLimits(CheckedFields):
    """What clients may take; whoever wants more gets an error message and is sent away.

    Args:
        clients: how many there may be at once. One that has left counts until its planning call has
            returned.
        message_bytes: greatest length of a message; of a longer one nothing is read.
        message_s: time for a whole message, from its first byte to its last, in either direction,
            and from connecting to the end of the hello [s].
        idle_s: time in which a client may be silent that waits for no reply [s].
    """

    field_prefix: ClassVar[str] = "server limit "

    clients: Annotated[int, Limits(1, 1000)] = 8
    message_bytes: Annotated[int, Limits(1000, 64_000_000)] = 4_000_000
    message_s: PositiveFloat = 10.0
    idle_s: PositiveFloat = 600.0
