"""Proven bounds and best known costs of scenarios: shipped data."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType

from pushplan.files.output_files import write_atomic
from pushplan.world import InvalidInputError, SchemaError
from pushplan.world.checked_fields import CheckedFields, NonNegativeFloat

BOUNDS_FILE = "data/bounds.csv"
"""File of the bounds in the package."""
_OVERLAPS = 0.01  # of a bound, by which what simulators leave overlapping may undercut it
_COLUMNS = ("scenario", "robot_mass_kg", "bound_kg_m", "best_kg_m", "best_policy")


@dataclass(frozen=True)
class KnownBounds(CheckedFields):
    """Bound and best known value of m₀ l₀ + Σ mᵢ lᵢ in a successful episode of one scenario.

    Args:
        robot_mass: m₀ [kg].
        bound: that no episode undercuts, proven [kg m].
        best: the least of any episode so far [kg m]; None where none succeeded.
        best_policy: label of the policy that drove it; empty where there is none.
    """

    robot_mass: NonNegativeFloat
    bound: NonNegativeFloat
    best: NonNegativeFloat | None = None
    best_policy: str = ""

    def better(self, work: float, policy: str) -> KnownBounds:
        """The same, with one more solution known.

        Raises:
            InvalidInputError: if it undercuts the bound by more than overlaps can explain.
        """
        if work < (1.0 - _OVERLAPS) * self.bound:
            raise InvalidInputError(
                f"a solution by {policy} of {work:g} kg m undercuts the bound of {self.bound:g} "
                "kg m: the bound or the episode is wrong"
            )
        if self.best is not None and self.best <= work:
            return self
        return KnownBounds(self.robot_mass, self.bound, work, policy)


@cache
def known_bounds() -> Mapping[str, KnownBounds]:
    """Return the bounds that ship with pushplan, by `Scenario.key`."""
    return MappingProxyType(load_bounds(Path(__file__).parent / BOUNDS_FILE))


def load_bounds(path: str | Path) -> dict[str, KnownBounds]:
    """Read what `save_bounds` wrote.

    Raises:
        SchemaError: if there is no such file, or a line of it cannot be read.
    """
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise SchemaError(f"bounds {path}: cannot be read: {error}") from error
    reader = csv.DictReader(lines)
    if tuple(reader.fieldnames or ()) != _COLUMNS:
        raise SchemaError(f"bounds {path}: the columns must be {', '.join(_COLUMNS)}")
    found: dict[str, KnownBounds] = {}
    for row in reader:
        try:
            if None in row:
                raise ValueError(f"expected {len(_COLUMNS)} values")
            found[row["scenario"]] = KnownBounds(
                float(row["robot_mass_kg"]),
                float(row["bound_kg_m"]),
                float(row["best_kg_m"]) if row["best_kg_m"] else None,
                row["best_policy"],
            )
        except (ValueError, TypeError) as error:
            raise SchemaError(f"bounds {path}, line {reader.line_num}: {error}") from error
    return found


def save_bounds(path: str | Path, bounds: Mapping[str, KnownBounds]) -> None:
    """Write them as CSV, by the names of the scenarios.

    Raises:
        OSError: if the file cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for key, one in sorted(bounds.items()):
        best = "" if one.best is None else f"{one.best:.6g}"
        numbers = f"{one.robot_mass:.6g}", f"{one.bound:.6g}", best
        writer.writerow([key, *numbers, one.best_policy])
    write_atomic(Path(path), text.getvalue().encode())
