"""Which code of the original the bridge drives, and whether a checkout is of the same.

Runs in the virtual environment of ``benchnpin``; ``bench.py`` calls it::

    python versions.py [CHECKOUT]
"""

from __future__ import annotations

import importlib.metadata
import re
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import yaml

ROOTS = ("benchpush", "benchnpin")
"""Names that the original's package has had."""
BODY = ("robot", "agent", "ship", "boxes", "goal_radius")
"""What of a configuration a planner has to have in common with its environment."""


def main() -> None:
    """Print the name, or end with a line that says what does not belong together."""
    spec = find_spec("benchnpin")
    if spec is None or spec.origin is None:
        raise SystemExit("there is no package benchnpin")
    try:
        installed = f"benchnpin {importlib.metadata.version('benchnpin')}"
    except importlib.metadata.PackageNotFoundError:
        installed = f"benchnpin {stated(Path(spec.origin).parents[1]) or 'of no stated version'}"
    if len(sys.argv) > 1:
        refuse_mixture(Path(sys.argv[1]), Path(spec.origin).parent, installed)
    sys.stdout.write(installed + "\n")


def stated(folder: Path) -> str:
    """The version that the files of a checkout state; empty if none does."""
    for name in ("pyproject.toml", "setup.cfg", "setup.py"):
        text = (folder / name).read_text(encoding="utf-8") if (folder / name).is_file() else ""
        if found := re.search(r"^\s*version\s*=\s*[\"']?([0-9][^\"'\s,]*)", text, re.MULTILINE):
            return found[1]
    return ""


def refuse_mixture(checkout: Path, package: Path, installed: str) -> None:
    """End with a line if planners of a checkout were made for other environments."""
    version = stated(checkout)
    rule = "its planners and the installed environments have to be of one version"
    if version and version != installed.split()[1]:
        raise SystemExit(f"{checkout} is version {version}, installed is {installed}: {rule}")
    for root in ROOTS:
        for file in sorted((checkout / root / "environments").glob("**/config.yaml")):
            place = file.relative_to(checkout / root)
            if (package / place).is_file():
                theirs = dict(leaves(file))
                ours = dict(leaves(package / place))
                for key in sorted(theirs.keys() | ours.keys()):
                    if theirs.get(key) != ours.get(key):
                        raise SystemExit(
                            f"{place} has {key} {theirs.get(key)} in {checkout} and "
                            f"{ours.get(key)} in the installed {installed}: {rule}"
                        )


def leaves(file: Path) -> Iterator[tuple[str, object]]:
    """Key and value of each number that matters in a configuration."""
    with file.open(encoding="utf-8") as stream:
        found = yaml.load(stream, Loader=yaml.FullLoader)  # they have tuples
    for key in BODY:
        value = found.get(key)
        for name, one in value.items() if isinstance(value, dict) else [("", value)]:
            if isinstance(one, int | float | list) and not isinstance(one, bool):
                yield f"{key}.{name}".rstrip("."), one


if __name__ == "__main__":
    main()
