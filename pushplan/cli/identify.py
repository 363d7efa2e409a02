"""``pushplan identify``: friction and pressure from the pushes in logs."""

from __future__ import annotations

import argparse

from pushplan.cli.common import load_episode, say, say_json
from pushplan.cli.output_files import check_file

_NAMES = ("friction", "gyration scale", "friction at walls")


def run(options: argparse.Namespace) -> int:
    """Find pushes, identify, print and write the parameters."""
    from pushplan.interaction import ContactParameters, find_pushes, identify

    check_file(options.out, (".json",))
    prior = ContactParameters.prior(options.materials)
    pushes = []
    for log in options.logs:
        pushes += find_pushes(load_episode(log), options.objects)
    found = identify(pushes, prior)
    if options.out:
        found.save(options.out)
    if options.json:
        say_json(found.to_dict())
        return 0
    say(f"{found.pushes} pushes, predicted ends miss by {1e3 * found.miss:.2g} mm")
    for name, value, deviation in zip(_NAMES, found.values, found.deviations, strict=True):
        unseen = name == _NAMES[-1] and not found.saw_walls
        note = " (not observed: the prior)" if unseen else ""
        say(f"  {name:20s}{value:.3f} +- {deviation:.3f}{note}")
    say(
        f"  {'overlap in contact':20s}{1e3 * found.overlap:.2f} "
        f"+- {1e3 * found.overlap_deviation:.2f} mm"
    )
    if options.out:
        say(f"wrote {options.out}")
    return 0
