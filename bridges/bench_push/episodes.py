"""Episodes that `drive.py` wrote, their scores by both codes, and a file that keeps the scores."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from pushplan.metrics import compute
from pushplan.world import Episode, world_from_dict

SCORES = {"theirs": ("S", "E", "I"), "ours": ("S", "E", "I", "work")}
WAITS = ("median_ms", "longest_ms")
_KEYS = ("original", "scene", "variation", "policy", "most_steps", "seed")
FIRST = "benchnpin 0.1.1"
"""The only original until episodes said which one they are of."""
_VALUES = (*(f"{by}_{name}" for by, names in SCORES.items() for name in names), *WAITS)


@dataclass(frozen=True)
class Run:
    """What one policy did in one scene of one version of the original, by seed."""

    original: str
    scene: str
    variation: str
    policy: str
    seeds: range
    most_steps: int
    episodes: dict[int, dict[str, float]] = field(default_factory=dict)  # by seed: all `_VALUES`

    def values(self, name: str) -> dict[int, float]:
        """A value of every seed, such as ``"ours_E"``, or one of `WAITS`."""
        return {seed: one[name] for seed, one in self.episodes.items()}

    @property
    def missing(self) -> list[int]:
        """Seeds that have no episode."""
        return [seed for seed in self.seeds if seed not in self.episodes]

    @property
    def name(self) -> str:
        """Scene, variation and policy in words."""
        return f"{self.scene} {self.variation}, {self.policy}"


def file_of(folder: Path, scene: str, variation: str, policy: str) -> Path:
    """Where the episodes of a policy in a scene are."""
    return folder / f"{scene}-{variation}-{re.sub(r'[^A-Za-z0-9.-]+', '_', policy)}.jsonl"


def whole(path: Path, run: Run) -> dict[int, str]:
    """The lines of a file by seed, without one that was cut off and those of other limits.

    Raises:
        SystemExit: if they are of another version of the original.
    """
    lines = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.is_file() else []:
        try:
            one = json.loads(line)
        except json.JSONDecodeError:
            continue
        if (original := one.get("original", FIRST)) != run.original:
            raise SystemExit(f"{path} has episodes of {original}, not of {run.original}")
        if one["most_steps"] == run.most_steps:
            lines[int(one["seed"])] = line
    return lines


def mend(path: Path, lines: dict[int, str]) -> None:
    """Leave these lines in a file to which more are added: all at once, so that none is lost."""
    if path.is_file():
        partial = path.with_suffix(".part")
        partial.write_text("".join(line + "\n" for line in lines.values()), encoding="utf-8")
        partial.replace(path)


def read(run: Run, path: Path) -> Run:
    """A run with the scores of the episodes of a file, beside those that it has."""
    episodes = dict(run.episodes)
    lines = whole(path, run)
    for seed in lines.keys() & set(run.seeds):
        one = json.loads(lines[seed])
        one["ours"] = ours(scored(one))
        waits = 1e3 * np.array(one["act_s"])
        scores = {f"{by}_{name}": one[by][name] for by in SCORES for name in SCORES[by]}
        episodes[seed] = {
            **scores,
            "median_ms": float(np.median(waits)),
            "longest_ms": float(waits.max()),
        }
    return replace(run, episodes=dict(sorted(episodes.items())))


def recalled(run: Run, path: Path) -> Run:
    """A run with those of its scores that a file of `keep` has.

    Raises:
        ValueError: if the file is not one of `keep`.
    """
    of_run = (run.original, run.scene, run.variation, run.policy, run.most_steps)
    kept = _kept(path)
    return replace(
        run, episodes={k[-1]: kept[k] for k in kept if k[:-1] == of_run and k[-1] in run.seeds}
    )


def keep(run: Run, path: Path) -> None:
    """Write its scores down, so that tables can be made and extended without the episodes."""
    kept = _kept(path)
    for seed, one in run.episodes.items():
        kept[run.original, run.scene, run.variation, run.policy, run.most_steps, seed] = one
    partial = path.with_suffix(".part")
    with partial.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*_KEYS, *_VALUES])
        for key in sorted(kept):
            writer.writerow([*key, *(f"{kept[key][name]:.6g}" for name in _VALUES)])
    partial.replace(path)


def _kept(path: Path) -> dict[tuple[str, str, str, str, int, int], dict[str, float]]:
    """Scores by original, scene, variation, policy, limit of steps and seed."""
    if not path.is_file():
        return {}
    with path.open(encoding="utf-8", newline="") as file:
        rows = csv.DictReader(file)
        if rows.fieldnames != [*_KEYS, *_VALUES]:
            raise ValueError(f"{path} must have the columns {', '.join([*_KEYS, *_VALUES])}")
        return {
            (
                one["original"],
                one["scene"],
                one["variation"],
                one["policy"],
                int(one["most_steps"]),
                int(one["seed"]),
            ): {name: float(one[name]) for name in _VALUES}
            for one in rows
        }


def scored(one: dict[str, Any]) -> Episode:
    """An episode of ours from what `drive.py` wrote."""
    count = len(one["times"])
    return Episode(
        world=world_from_dict(one["world"]),
        times=np.array(one["times"]),
        robot_poses=np.array(one["robot_poses"]),
        object_poses=np.array(one["object_poses"]).reshape(count, -1, 3),
        success=one["success"],
        reason=one["reason"],
        completed=np.array(one["completed"]) if one["completed"] else None,
    )


def ours(episode: Episode) -> dict[str, float]:
    """Success, E and I as `pushplan bench` has them, and the work [kg m]."""
    found = compute(episode)
    kind = "manip" if "E_manip" in found else "nav"
    return {
        "S": found.get("S_manip", float(episode.success)),
        "E": found[f"E_{kind}"],
        "I": found[f"I_{kind}"],
        "work": found["interaction_work_kg_m"],
    }
