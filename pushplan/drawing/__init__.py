"""A `pushplan.world.World` as a picture."""

from pushplan.drawing.files import save_animation, save_image
from pushplan.drawing.scene import draw_world

__all__ = ["draw_world", "save_animation", "save_image"]
