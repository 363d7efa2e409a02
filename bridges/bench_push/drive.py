"""Drives an environment of ``benchnpin`` with a policy server, and writes what happened.

Runs in the virtual environment of ``benchnpin``; ``bench.py`` calls it::

    python drive.py ADDRESS --scene maze --variation 5 --seeds 0-29 --out episodes.jsonl
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("MPLBACKEND", "Agg")
os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))

import numpy as np
from scenes import SCENES, Scene, pose_of
from serve_client import PolicyClient


def main() -> None:
    """Drive every seed and write a line of JSON for each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("address", help="of 'pushplan serve': unix:PATH or tcp:HOST:PORT")
    parser.add_argument("--scene", choices=SCENES, required=True)
    parser.add_argument("--variation", required=True)
    parser.add_argument("--seeds", required=True, metavar="FIRST-LAST")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--most-steps", type=int, default=20_000)
    options = parser.parse_args()
    first, last = (int(seed) for seed in options.seeds.split("-"))
    scene = SCENES[options.scene][0](options.variation)
    with PolicyClient(options.address) as client, options.out.open("w") as file:
        for seed in range(first, last + 1):
            episode = drive(scene, client, seed, options.most_steps)
            file.write(json.dumps(episode) + "\n")
            file.flush()


def drive(scene: Scene, client: PolicyClient, seed: int, most_steps: int) -> dict:
    """One episode: the start, everything's poses, and the scores of their code."""
    info = scene.reset(seed)
    metric = metric_of(scene)
    metric.reset(info)
    world = scene.world()
    client.reset(world, seed)
    times, robot = [0.0], [pose_of(scene.body)]
    objects = [[pose_of(one.body) for one in scene.objects]]
    waits, reason, done = [], "", False
    while not done:
        began = time.perf_counter()
        twist = client.act(**scene.state())["twist"]
        waits.append(time.perf_counter() - began)
        reward, terminated, truncated, info = scene.step(twist["linear"], twist["angular"])
        times.append(scene.time)
        robot.append(pose_of(scene.body))
        objects.append([pose_of(one.body) for one in scene.objects])
        too_long = len(waits) == most_steps
        done = terminated or truncated or too_long
        reason = "limit" if truncated or too_long else "terminated"
        complete(info)
        metric.update(info, reward, eps_complete=done)
    statuses = [bool(one) for one in info.get("box_completed_statuses", [])]
    success = all(statuses) if statuses else bool(info.get("trial_success"))
    return {
        "seed": seed,
        "world": world,
        "idle_limit": scene.idle_limit,
        "times": times,
        "robot_poses": robot,
        "object_poses": objects,
        "completed": statuses,
        "success": success,
        "reason": "goal" if success else reason,
        "act_s": waits,
        "theirs": {
            "S": metric.success_rates[-1] if statuses else float(success),
            "E": float(np.nan_to_num(metric.efficiency_scores[-1])),  # 0 / 0 for who never moved
            "I": float(np.nan_to_num(metric.effort_scores[-1])),
        },
    }


def metric_of(scene: Scene) -> object:
    """Their metric for this scene."""
    module, _, name = scene.metric.partition(":")
    kind = getattr(importlib.import_module(f"benchnpin.common.metrics.{module}"), name)
    goal = {"goal": scene.inner.goal} if scene.name == "ship-ice-v0" else {}
    return kind("pushplan", scene.robot_mass(), **goal)


def complete(info: dict) -> None:
    """Fill in what their metric reads and their environment leaves out."""
    info.setdefault("trial_success", False)


if __name__ == "__main__":
    main()
