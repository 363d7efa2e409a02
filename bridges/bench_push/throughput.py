"""Steps a second of our environments and of the original's, in turns on one machine.

    python bridges/bench_push/throughput.py --python BENCHNPIN/bin/python [--seconds 5] [--rounds 3]

Mazes and ice with image observations of the same size and control period, random turn rates,
resets left out. The original's other scenes draw images with a package that no registry has.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from bench import without_python

from pushplan.envs import PushEnv

HERE = Path(__file__).parent
SCENES = (
    ("maze", "5", {"boxes": 5}),
    ("maze", "10", {"boxes": 10}),
    ("ship_ice", "10", {"concentration": 0.1}),
    ("ship_ice", "50", {"concentration": 0.5}),
)


def main() -> None:
    """Measure in turns, print the ratios of the rounds."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--python", required=True, help="interpreter that has benchnpin")
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    print("| environment | ours [steps/s] | original [steps/s] | ratio, least to most |")
    print("|---|--:|--:|--:|")
    for task, variation, variations in SCENES:
        ours = []
        theirs = []
        for _ in range(options.rounds):
            theirs.append(original(options.python, task, variation, options.seconds))
            ours.append(own(task, variations, options.seconds))
        ratios = np.array(ours) / np.array(theirs)
        print(
            f"| {task} {variation} | {np.median(ours):,.0f} | {np.median(theirs):.1f} | "
            f"{ratios.min():.0f} to {ratios.max():.0f} x |",
            flush=True,
        )


def original(python: str, task: str, variation: str, seconds: float) -> float:
    """Steps a second of theirs."""
    command = [python, "-W", "ignore", str(HERE / "rate.py"), task, variation, str(seconds)]
    done = subprocess.run(command, env=without_python(), capture_output=True, text=True, check=True)
    steps, spent = done.stdout.split()[-2:]
    return int(steps) / float(spent)


def own(task: str, variations: dict[str, float], seconds: float) -> float:
    """Steps a second of ours."""
    env = PushEnv(task=task, variations=variations, observation="image")
    rng = np.random.default_rng(0)
    env.reset(seed=0)
    steps = 0
    spent = 0.0
    over = False
    while spent < seconds:
        if over:
            env.reset(seed=steps)
        action = rng.uniform(-0.5, 0.5, 1).astype(np.float32)
        began = time.perf_counter()
        *_, terminated, truncated, _ = env.step(action)
        spent += time.perf_counter() - began
        steps += 1
        over = terminated or truncated
    return steps / spent


if __name__ == "__main__":
    sys.exit(main())
