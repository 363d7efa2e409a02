"""``pushplan identify``: friction and pressure from the pushes in logs."""

from __future__ import annotations

import argparse

from pushplan.cli.common import load_episode, say, say_json


def run(options: argparse.Namespace) -> int:
    """Find pushes, identify, print the parameters."""
    from pushplan.interaction import find_pushes, identify

    pushes = []
    for log in options.logs:
        pushes += find_pushes(load_episode(log), options.objects)
    found = identify(pushes)
    if options.json:
        say_json(found.to_dict())
        return 0
    names = ["friction", "gyration scale", "friction at walls, not observed"]
    if found.saw_walls:
        names[2] = "friction at walls"
    say(f"{found.pushes} pushes, predicted ends miss by {1e3 * found.miss:.2g} mm")
    for name, value, deviation in zip(names, found.values, found.deviations, strict=True):
        say(f"  {name:33s}{value:.3f} +- {deviation:.3f}")
    overlap = f"{1e3 * found.overlap:.2f} +- {1e3 * found.overlap_deviation:.2f} mm"
    say(f"  {'overlap in contact':33s}{overlap}")
    return 0
