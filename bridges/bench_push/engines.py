"""The same policy from the same start in the original's engine and in ours.

    python bridges/bench_push/engines.py --python BENCHNPIN/bin/python [--scenes maze-5,ship_ice]
        [--policies straight,push-aware] [--seeds 0-19] [--out runs/bench_push] [--page PAGE.md]

The original's episodes are those of ``bench.py``; what is missing is driven. Ours begin in the
worlds that they began in: same robot, outlines, contact radii, friction, action period and limits.
Both are scored by our metrics on poses of the same rate, so that what differs is the engine. Ours
runs as usual and with what is known to differ set as there: the original keeps the direction of a
velocity while the robot turns (not in deliveries), and leaves overlaps of up to 10 cm alone.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
from bench import POLICIES, chosen, finished, original_of, parser_of, say
from episodes import Run, file_of, mend, ours, whole
from tables import ranges, write

from pushplan.envs import PushEnv
from pushplan.envs.simulators.pymunk_simulator import PymunkOptions, PymunkSimulator
from pushplan.evaluation import run_episode
from pushplan.evaluation.run.policy_specs import parse_policies
from pushplan.evaluation.statistics.estimates import estimate
from pushplan.scenarios import Scenario
from pushplan.world import Episode

FRICTION = {  # between robot and objects, two objects, objects and walls
    "maze": (0.0, 1.0, 0.5),
    "ship_ice": (1.0, 1.0, 1.0),
    "area_clearing": (0.0, 1.0, 0.99),
    "box_delivery": (1.0, 1.0, 1.0),
}
"""As the shapes of the original have them, whose products are those of the pairs."""
SCORES = ("S", "E", "I", "work")
ENGINES = {"ours": False, "ours, its settings": True}
"""Whether ours runs with the settings of the original."""
SLOP = 0.1
"""Overlap that the original leaves alone [m]."""


@dataclass(frozen=True)
class Pairs:
    """One policy in one scene, by engine: scores by name and start."""

    run: Run
    seeds: list[int]  # that all engines have
    theirs: dict[str, list[float]]
    ours: dict[str, dict[str, list[float]]]


def main() -> int:
    """Run what is missing and print the table."""
    parser = parser_of()
    parser.description = (__doc__ or "").splitlines()[0]
    parser.set_defaults(seeds="0-19")
    options = parser.parse_args()
    try:
        scenes = chosen(options.scenes)
        first, last = (int(seed) for seed in options.seeds.split("-"))
    except ValueError as error:
        parser.error(str(error))
    original = original_of(options, parser)
    options.out.mkdir(parents=True, exist_ok=True)
    found = []
    for scene, variation in scenes:
        names = options.policies.split(",") if options.policies else POLICIES[scene]
        for policy in names:
            seeds = range(first, last + 1)
            run = Run(original, scene, variation, policy, seeds, options.most_steps)
            found.append(pairs(finished(run, options), options))
    text = report(found)
    say(text)
    if options.page:
        write(options.page, text, "engines.py")
    return 0


def pairs(run: Run, options: argparse.Namespace) -> Pairs:
    """The scores of the engines, start by start; starts that ours has not run yet are run."""
    starts = whole(file_of(options.out, run.scene, run.variation, run.policy), run)
    ours = {}
    for engine, alike in ENGINES.items():
        name = f"{run.policy}-own-engine{'-its-settings' if alike else ''}"
        path = file_of(options.out, run.scene, run.variation, name)
        done = whole(path, run)
        missing = [seed for seed in run.episodes if seed not in done]
        if missing and not options.only_report:
            say(f"{run.name}, {engine}: {len(missing)} episodes")
            mend(path, done)
            for seed in missing:
                repeat(run, json.loads(starts[seed]), path, options.most_steps, alike)
            done = whole(path, run)
        ours[engine] = {seed: json.loads(line) for seed, line in done.items()}
    both = [seed for seed in run.episodes if all(seed in done for done in ours.values())]
    theirs = {name: [run.episodes[seed][f"ours_{name}"] for seed in both] for name in SCORES}
    scores = {engine: columns([done[seed] for seed in both]) for engine, done in ours.items()}
    return Pairs(run, both, theirs, scores)


def repeat(run: Run, start: dict[str, Any], path: Path, most_steps: int, alike: bool) -> None:
    """Run one start in our engine and add its scores to a file."""
    episode = in_own_engine(start, run.scene, run.policy, most_steps, alike)
    line = {"seed": start["seed"], "most_steps": most_steps, "reason": episode.reason}
    line["original"] = run.original
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps({**line, **ours(episode)}) + "\n")


def in_own_engine(
    start: dict[str, Any], scene: str, policy: str, most_steps: int, alike: bool = False
) -> Episode:
    """An episode of ours from the start of one of theirs, with a pose for each action."""
    period = start["times"][1] - start["times"][0]
    bumper, objects, walls = FRICTION[scene]
    with tempfile.TemporaryDirectory() as folder:
        world = Path(folder) / "world.json"
        world.write_text(json.dumps(start["world"]), encoding="utf-8")
        variations = {
            "world_file": str(world),
            "control_step": period,
            "time_limit": most_steps * period,
            "bumper_friction": bumper,
            "object_friction": objects,
            "wall_friction": walls,
        }
        if start.get("idle_limit") is not None:
            variations["idle_limit"] = start["idle_limit"]
        env = PushEnv(
            task="room",
            simulator=PymunkSimulator(its_settings(start, scene) if alike else None),
            variations=variations,
            observation="state",
            action="velocity",
        )
        scenario = Scenario("room", variations=variations, seed=start["seed"])
        episode = run_episode(env, parse_policies([policy])[0].make(), scenario)
    return every(episode, period)


def its_settings(start: dict[str, Any], scene: str) -> PymunkOptions:
    """Numerical settings as the original has them, as far as ours go."""
    objects = start["world"]["movables"]
    size = float(np.median([np.hypot(*np.array(one["outline"]).T).max() for one in objects]))
    slop = min(0.18, SLOP / size)
    return PymunkOptions(holds_direction=scene != "box_delivery", slop=slop, tolerance=0.2)


def every(episode: Episode, period: float) -> Episode:
    """The episode with poses at the ends of its actions alone."""
    steps = np.arange(len(episode.actions) + 1) * period
    at = np.clip(np.searchsorted(episode.times, steps - 1e-6), 0, len(episode.times) - 1)
    return Episode(
        world=episode.world,
        times=episode.times[at],
        robot_poses=episode.robot_poses[at],
        object_poses=episode.object_poses[at],
        success=episode.success,
        reason=episode.reason,
        completed=episode.completed,
    )


def columns(episodes: Sequence[dict[str, Any]]) -> dict[str, list[float]]:
    """Scores by name."""
    return {name: [float(one[name]) for one in episodes] for name in SCORES}


def report(found: Sequence[Pairs]) -> str:
    """The table as Markdown."""
    today = datetime.datetime.now(tz=datetime.UTC).date().isoformat()
    lines = [
        f"{today}, {platform.machine()}, {os.cpu_count()} cores. Means by our metrics; in brackets "
        "how much the mean is off the original engine's, and for E and I the 95 % bootstrap "
        "interval of the paired difference.",
        "",
        "| scene | policy | seeds | engine | S | E | I | work [kg m] |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for one in found:
        run = one.run
        cells = [f"{run.scene} {run.variation}".replace("_", " "), f"`{run.policy}`"]
        cells += [ranges(one.seeds), "original"]
        cells += [shown(name, one.theirs[name]) for name in SCORES]
        lines.append("| " + " | ".join(cells) + " |")
        for engine, scores in one.ours.items():
            cells = ["", "", "", engine]
            cells += [shown(name, scores[name], one.theirs[name]) for name in SCORES]
            lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def shown(name: str, values: Sequence[float], others: Sequence[float] | None = None) -> str:
    """A mean, and how far it is from the mean on the same starts in the other engine."""
    mean = np.mean(values)
    text = f"{mean:.3g}" if name == "work" else f"{mean:.{2 if name == 'S' else 3}f}"
    if others is None or name == "S" or not np.mean(others):
        return text
    text += f" ({100.0 * (mean / np.mean(others) - 1.0):+.1f} %"
    if name != "work":
        gap = estimate((np.array(values) - np.array(others)).tolist())
        text += f"; {gap.low:+.3f}, {gap.high:+.3f}"
    return text + ")"


if __name__ == "__main__":
    sys.exit(main())
