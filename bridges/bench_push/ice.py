"""Writes the ice fields of ``benchnpin`` as plain arrays, which `pushplan` reads.

Runs in the virtual environment of ``benchnpin``, whose pickles are opened nowhere else::

    python ice.py --concentration 30 --fields 0-19 --out ice

Writes ``ice/30-0.npz`` and so on (``vertices``, ``offsets``, ``bounds``; see ``load_ice``) and
``ice/30.yaml``, the scenarios with these fields and starts: ``pushplan bench ice/30.yaml ...``.
"""

from __future__ import annotations

import argparse
import json
import pickle
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from outlines import hull

CHANNEL = (12.0, 40.0)
"""Width and length [m]."""


def main() -> None:
    """Convert the fields that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--concentration", type=int, choices=(10, 20, 30, 40, 50), required=True)
    parser.add_argument("--fields", default="0-19", metavar="FIRST-LAST", help="0 to 99")
    parser.add_argument("--out", type=Path, default=Path("ice"))
    options = parser.parse_args()
    first, last = (int(number) for number in options.fields.split("-"))
    trials = fields(options.concentration)
    options.out.mkdir(parents=True, exist_ok=True)
    scenarios = []
    for number in range(first, last + 1):
        trial = trials[number]
        path = options.out / f"{options.concentration}-{number}.npz"
        floes = [np.array(hull(one["vertices"])) for one in trial["obstacles"]]
        offsets = np.concatenate([[0], np.cumsum([len(floe) for floe in floes])])
        np.savez_compressed(
            path, vertices=np.concatenate(floes), offsets=offsets, bounds=np.array([0, 0, *CHANNEL])
        )
        variations = {"ice_file": str(path.resolve()), "start_x": float(trial["ship_state"][0])}
        scenarios.append(
            {
                "task": "ship_ice",
                "simulator": "pymunk",
                "preset": "original",
                "variations": variations,
                "seed": number,
            }
        )
    suite = {"schema": "pushplan-scenarios/1", "scenarios": scenarios}
    name = options.out / f"{options.concentration}.yaml"
    name.write_text(json.dumps(suite, indent=1), encoding="utf-8")


def fields(concentration: int) -> dict:
    """Their trials by number."""
    package = Path(find_spec("benchnpin").origin).parent / "environments" / "ship_ice_nav"
    file = package / "ice_environments" / f"experiments_{concentration}_100_r06_d40x12.pk"
    with file.open("rb") as stream:
        return pickle.load(stream)["exp"][concentration / 100.0]


if __name__ == "__main__":
    main()
