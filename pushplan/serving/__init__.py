"""A policy behind a socket: worlds in, commands out, for programs of any language."""

from pushplan.serving.address import Address
from pushplan.serving.connection import ServerLimits
from pushplan.serving.messages import PROTOCOL
from pushplan.serving.server import PolicyServer

__all__ = ["PROTOCOL", "Address", "PolicyServer", "ServerLimits"]
