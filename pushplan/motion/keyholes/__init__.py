"""Keyholes: closed ways that a push opens (Stilman and Kuffner 2005)."""

from pushplan.motion.keyholes.keyhole_config import KeyholeConfig
from pushplan.motion.keyholes.keyhole_search import (
    KeyholeEnd,
    KeyholeSearch,
    nearest_free_pose,
    suits_keyholes,
)

__all__ = ["KeyholeConfig", "KeyholeEnd", "KeyholeSearch", "nearest_free_pose", "suits_keyholes"]
