"""A `pushplan.world.World` as a picture."""

from pushplan.drawing.files import save_animation, save_image
from pushplan.drawing.scene import draw_world
from pushplan.drawing.sequence import draw_sequence

__all__ = ["draw_sequence", "draw_world", "save_animation", "save_image"]
