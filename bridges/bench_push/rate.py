"""How many steps a second an environment of ``benchnpin`` takes, with its images.

Runs in the virtual environment of ``benchnpin``; ``throughput.py`` calls it::

    python rate.py maze 5 10
"""

from __future__ import annotations

import os
import sys
import time

os.environ.setdefault("MPLBACKEND", "Agg")
os.environ.setdefault("SDL_VIDEODRIVER", "dummy")

import numpy as np
from scenes import SCENES


def main() -> None:
    """Print steps, and the seconds that stepping took; resets are left out, as with ours."""
    name, variation, seconds = sys.argv[1:]
    scene = SCENES[name][0](variation, images=True)
    rng = np.random.default_rng(0)
    scene.reset(0)
    steps = 0
    spent = 0.0
    over = False
    while spent < float(seconds):
        if over:
            scene.reset(steps)
        turn = rng.uniform(-0.5, 0.5) * scene.turns
        began = time.perf_counter()
        _, _, terminated, truncated, _ = scene.step(scene.action(scene.speeds()[1], turn))
        spent += time.perf_counter() - began
        steps += 1
        over = terminated or truncated
    sys.stdout.write(f"{steps} {spent}\n")


if __name__ == "__main__":
    main()
