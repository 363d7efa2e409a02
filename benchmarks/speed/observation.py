"""Time of one image observation at the start of each task, whole and by channel.

    python -m benchmarks.speed.observation [--pictures FOLDER]

``--pictures`` also writes the channels of each image side by side.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from benchmarks.reporting import command_line, median_ms
from pushplan.envs import make
from pushplan.geometry import distance_field, shadows
from pushplan.observation import ImageObservation, channels
from pushplan.scenarios import Scenario
from pushplan.world import World

CASES: dict[str, tuple[str, str, dict[str, Any]]] = {
    "maze, 10 boxes": ("maze", "image", {"boxes": 10}),
    "ship_ice, 10 %": ("ship_ice", "image", {"concentration": 0.1}),
    "ship_ice, 50 %": ("ship_ice", "image", {"concentration": 0.5}),
    "area_clearing, clear": ("area_clearing", "image", {}),
    "area_clearing, walled with columns": (
        "area_clearing",
        "image",
        {"layout": "walled_with_columns"},
    ),
    "box_delivery, large columns": ("box_delivery", "image", {"layout": "large_columns"}),
    "box_delivery, large divider": ("box_delivery", "image", {"layout": "large_divider"}),
    "box_delivery, large columns, spatial": (
        "box_delivery",
        "spatial",
        {"layout": "large_columns"},
    ),
}


def first_time(view: ImageObservation, world: World) -> float:
    """Median time of an observation of a map that was never seen before [ms]."""

    def call() -> None:
        for cache in (
            channels._distance_raster,
            channels._static_parts,
            distance_field._field,
            shadows.bend_distances,
        ):
            cache.cache_clear()
        view.observe(world)

    return median_ms(call, 9)


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("--pictures", type=Path, help="folder for the channels of each image")
    folder = parser.parse_args().pictures
    for title, (task, name, variations) in CASES.items():
        env = make(Scenario(task, variations=variations, seed=1), observation=name)
        env.reset()
        view = env.task.observation(name)
        assert isinstance(view, ImageObservation)
        world = env.world
        image = view.observe(world)
        whole = median_ms(lambda view=view, world=world: view.observe(world), 300)
        new = first_time(view, world)
        print(f"{title} {view.shape}: {whole:.3f} ms, {new:.1f} ms for a new map")
        for channel in view.channels:
            one = replace(view, channels=(channel,))
            span = median_ms(lambda one=one, world=world: one.observe(world), 300)
            print(f"  {channel:16}{span:8.3f} ms")
        if folder is not None:
            tiles = [np.pad(layer, 2, constant_values=90) for layer in image]
            Image.fromarray(np.hstack(tiles)).save(folder / f"{title.replace(' ', '_')}.png")


if __name__ == "__main__":
    main()
