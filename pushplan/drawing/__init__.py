"""A `pushplan.world.World` as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pushplan.imports.on_demand import lazy_names

if TYPE_CHECKING:
    from pushplan.drawing.figure import Panel, draw_figure, save_figure
    from pushplan.drawing.files import save_animation, save_image
    from pushplan.drawing.legend import Entry, add_strips, legend_of
    from pushplan.drawing.top_view import draw_world

__all__ = [
    "Entry",
    "Panel",
    "add_strips",
    "draw_figure",
    "draw_world",
    "legend_of",
    "save_animation",
    "save_figure",
    "save_image",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "figure": "Panel draw_figure save_figure",
        "files": "save_animation save_image",
        "legend": "Entry add_strips legend_of",
        "top_view": "draw_world",
    },
)
