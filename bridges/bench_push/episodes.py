"""Episodes that `drive.py` wrote: which are there, and our scores beside theirs."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pushplan.metrics import compute
from pushplan.world import Episode, world_from_dict


@dataclass(frozen=True)
class Run:
    """What one policy did in one scene, by seed."""

    scene: str
    variation: str
    policy: str
    seeds: range
    episodes: dict[int, dict[str, Any]] = field(default_factory=dict)

    def values(self, by: str, name: str) -> dict[int, float]:
        """A score of every seed, by ``"theirs"`` or by ``"ours"``."""
        return {seed: one[by][name] for seed, one in self.episodes.items()}

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


def whole(path: Path, most_steps: int) -> dict[int, str]:
    """The lines of a file by seed, without one that was cut off and those of other limits."""
    lines = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.is_file() else []:
        try:
            one = json.loads(line)
        except json.JSONDecodeError:
            continue
        if one["most_steps"] == most_steps:
            lines[int(one["seed"])] = line
    return lines


def mend(path: Path, lines: dict[int, str]) -> None:
    """Leave these lines in a file to which more are added: all at once, so that none is lost."""
    if path.is_file():
        partial = path.with_suffix(".part")
        partial.write_text("".join(line + "\n" for line in lines.values()), encoding="utf-8")
        partial.replace(path)


def read(run: Run, path: Path, most_steps: int) -> Run:
    """A run with the episodes of a file, with our scores beside theirs."""
    episodes = {}
    lines = whole(path, most_steps)
    for seed in sorted(lines.keys() & set(run.seeds)):
        one = json.loads(lines[seed])
        one["ours"] = ours(scored(one))
        episodes[seed] = {key: one[key] for key in ("ours", "theirs", "act_s", "reason")}
    return Run(run.scene, run.variation, run.policy, run.seeds, episodes)


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
