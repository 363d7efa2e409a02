"""Drives an environment of ``benchnpin`` and writes what happened.

Runs in the virtual environment of ``benchnpin``; ``bench.py`` calls it::

    python drive.py ADDRESS --scene maze --variation 5 --seeds 0,3-29 --out episodes.jsonl
    python drive.py theirs:FILE.py:CLASS --scene maze --variation 5 --seeds 0-29 --out ...
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

import numpy as np
from checkout import take_from
from drivers import PolicyFailure, Served, Theirs, policy_of
from outlines import pose_of
from scenes import SCENES, Scene

_roll = np.roll


def main() -> int:
    """Drive every seed and add a line of JSON for each. An episode that fails is left out."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("policy", help="address of 'pushplan serve', or theirs:NAME")
    parser.add_argument("--scene", choices=SCENES, required=True)
    parser.add_argument("--variation", required=True)
    parser.add_argument("--seeds", required=True, metavar="0,3-29")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--most-steps", type=int, default=20_000)
    parser.add_argument("--named", required=True, help="what the original is called")
    parser.add_argument("--original", type=Path, help="checkout of the original's repository")
    parser.add_argument("--glns", metavar="COMMAND", help="the solver that theirs:gtsp calls")
    options = parser.parse_args()
    if options.original:
        take_from(options.original)
    np.roll = quick_roll
    scene, driver = made(options)
    failed = 0
    for seed in seeds_of(options.seeds):
        try:
            episode = drive(scene, driver, seed, options.most_steps, options.named)
        except PolicyFailure as error:
            failed += 1
            complain(f"seed {seed}: the policy failed: {error}")
            continue
        except OSError as error:
            complain(f"seed {seed}: the policy server has gone: {error}")
            return 1
        with options.out.open("a") as file:
            file.write(json.dumps(episode) + "\n")
    return 1 if failed else 0


def made(options: argparse.Namespace) -> tuple[Scene, Served | Theirs]:
    """The environment and what drives it."""
    kind = SCENES[options.scene][0]
    if options.policy.startswith("theirs:"):
        policy = policy_of(options.policy.removeprefix("theirs:"), options.glns)
        scene = kind(options.variation, images=getattr(policy, "images", True))
        return scene, Theirs(scene, policy)
    scene = kind(options.variation)
    return scene, Served(scene, options.policy)


def seeds_of(text: str) -> list[int]:
    """The numbers of ``"0,3-29"``."""
    ends = [word.partition("-") for word in text.split(",")]
    return [k for low, _, high in ends for k in range(int(low), int(high or low) + 1)]


def complain(text: str) -> None:
    """Say a line to `bench.py`, which shows it."""
    sys.stderr.write(text + "\n")
    sys.stderr.flush()


def drive(scene: Scene, driver: Served | Theirs, seed: int, most_steps: int, original: str) -> dict:
    """One episode: the start, everything's poses, and the scores of their code."""
    seen, info = scene.reset(seed)
    metric = metric_of(scene)
    metric.reset(info)
    world = scene.world()
    driver.begin(world, seed)
    times = [0.0]
    robot = [pose_of(scene.body)]
    objects = [[pose_of(one.body) for one in scene.objects]]
    waits = []
    reason = ""
    done = False
    while not done:
        began = time.perf_counter()
        action = driver.action(seen, info)
        waits.append(time.perf_counter() - began)
        seen, reward, terminated, truncated, info = scene.step(action)
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
        "most_steps": most_steps,
        "original": original,
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
    metric = kind("pushplan", scene.robot_mass(), **goal)
    if not hasattr(metric, "box_mass"):
        metric.box_mass = None  # the code of 2026 reads it, and nothing there sets it
    return metric


def quick_roll(values: np.ndarray, shift: int, axis: int | None = None) -> np.ndarray:
    """The same as `numpy.roll`; their metric calls it a million times on a few numbers."""
    values = np.asarray(values)
    if axis is not None or values.ndim != 1 or not len(values):
        return _roll(values, shift, axis)
    cut = -shift % len(values)
    return np.concatenate((values[cut:], values[:cut]))


def complete(info: dict) -> None:
    """Fill in what their metric reads and their environment leaves out."""
    info.setdefault("trial_success", False)


if __name__ == "__main__":
    sys.exit(main())
