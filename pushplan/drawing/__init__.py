"""A `pushplan.world.World` as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pushplan.world.lazy_names import lazy_names

if TYPE_CHECKING:
    from pushplan.drawing.files import save_animation, save_image
    from pushplan.drawing.scene import draw_world
    from pushplan.drawing.sequence import draw_sequence

__all__ = ["draw_sequence", "draw_world", "save_animation", "save_image"]

__getattr__, __dir__ = lazy_names(
    __name__,
    {"files": "save_animation save_image", "scene": "draw_world", "sequence": "draw_sequence"},
)
