"""Write motion primitives to a file: see ``--help``."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from pushplan.errors import InvalidInputError
from pushplan.motion.state_lattice.primitive_set import PrimitiveConfig
from pushplan.motion.state_lattice.primitives import generate

SHIPPED = (PrimitiveConfig(8, 6.0, 1, 0), PrimitiveConfig(16, 6.0), PrimitiveConfig(16, 19.0))
"""The sets that ship with pushplan; others are made when they are needed."""


def write(config: PrimitiveConfig, folder: Path) -> Path:
    """Generate a set and write it into ``folder`` under the name of its configuration."""
    path = folder / f"{config.key}.json"
    text = json.dumps(generate(config).to_json(), separators=(",", ":"))
    path.write_text(text + "\n", encoding="utf-8")
    return path


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(
        prog="python -m pushplan.motion.state_lattice.generate",
        description="Generate motion primitives in units of the lattice step.",
    )
    parser.add_argument("--headings", type=int, choices=(8, 16, 32), help="default: 16")
    parser.add_argument("--radius", type=float, help="turning radius [steps], default: 6")
    parser.add_argument("--variants", type=int, help="primitives between two headings, default: 2")
    parser.add_argument("--shifts", type=int, help="lane changes to each side, default: 3")
    parser.add_argument("--shipped", action="store_true", help="all sets that ship with pushplan")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "data")
    options = parser.parse_args(arguments)
    names = ("headings", "radius", "variants", "shifts")
    given = {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    try:
        configs = SHIPPED if options.shipped else (PrimitiveConfig(**given),)
    except InvalidInputError as error:
        parser.error(str(error))
    options.out.mkdir(parents=True, exist_ok=True)
    for config in configs:
        sys.stdout.write(f"{write(config, options.out)}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
