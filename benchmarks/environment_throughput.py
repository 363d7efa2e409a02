"""How many steps a second the environments take, with the image observation, and where time goes.

Usage::

    python benchmarks/environment_throughput.py [--steps 600] [--observation image]

Each row drives one environment with a gentle weave that meets boxes. A new episode starts where
one ends, after 100 steps, and where the robot has been held for 5 steps; resets are timed apart.
Shares are measured by wrapping the simulator and the observation builder of the environment in
timers. The first episode, in which kernels are loaded and distance fields are computed, is not
counted; what it costs stands in the last columns.
"""

from __future__ import annotations

import argparse
import importlib
import time
from collections.abc import Callable
from typing import Any

import numpy as np

# (preset, boxes, share on wheels)
ROWS = (
    ("benchmark", 3, 0.0),
    ("benchmark", 5, 0.0),
    ("benchmark", 10, 0.0),
    ("benchmark", 10, 0.5),
    ("testbed", 3, 0.0),
    ("testbed", 5, 0.0),
    ("testbed", 10, 0.0),
)


class Stopwatch:
    """Sums the time spent in the functions that it wraps."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def wrap(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, timed."""

        def timed(*args: Any, **kwargs: Any) -> Any:
            begin = time.perf_counter()
            try:
                return function(*args, **kwargs)
            finally:
                self.seconds += time.perf_counter() - begin

        return timed


class TimedBuilder:
    """An observation builder whose `observe` is timed."""

    def __init__(self, builder: Any, watch: Stopwatch) -> None:
        self._builder = builder
        self.observe = watch.wrap(builder.observe)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._builder, name)


def measure(
    preset: str, boxes: int, wheeled: float, steps: int, observation: str
) -> dict[str, float]:
    """Steps/s and shares of one environment."""
    import gymnasium

    begin = time.perf_counter()
    env = gymnasium.make(
        "pushplan/Maze-v0", preset=preset, boxes=boxes, wheeled=wheeled, observation=observation
    ).unwrapped
    made = time.perf_counter() - begin
    begin = time.perf_counter()
    env.reset(seed=0)
    first_reset = time.perf_counter() - begin
    env.step(np.zeros(1, np.float32))

    physics, seeing = Stopwatch(), Stopwatch()
    env._simulator.step = physics.wrap(env._simulator.step)
    env._builder = TimedBuilder(env._builder, seeing)
    stepping, resets, held = 0.0, [], 0
    over, stuck, age = True, 0, 0
    for i in range(steps):
        if over:
            seen = seeing.seconds
            begin = time.perf_counter()
            env.reset(seed=1 + len(resets))
            resets.append(time.perf_counter() - begin)
            seeing.seconds = seen
            stuck, age = 0, 0
        action = np.array([0.6 * np.sin(i / 9.0)], dtype=np.float32)
        begin = time.perf_counter()
        *_, terminated, truncated, info = env.step(action)
        stepping += time.perf_counter() - begin
        held += info["held"]
        stuck, age = stuck + 1 if info["held"] else 0, age + 1
        over = terminated or truncated or stuck == 5 or age == 100
    return {
        "rate": steps / stepping,
        "simulated": steps * env.task.control_step / stepping,
        "physics": physics.seconds / stepping,
        "observation": seeing.seconds / stepping,
        "held": held / steps,
        "reset": float(np.median(resets)),
        "first_reset": first_reset,
        "make": made,
    }


def main() -> None:
    """Measure every row and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=600, help="steps per row")
    parser.add_argument("--observation", default="image", choices=("image", "state"))
    options = parser.parse_args()

    begin = time.perf_counter()
    importlib.import_module("pushplan.envs.push_env")  # registers the ids on the way

    loaded = time.perf_counter() - begin
    print(f"importing Gymnasium and pushplan.envs: {loaded:.2f} s; observation: ", end="")
    print(options.observation)
    print(
        f"{'preset':10} {'boxes':>5} {'wheels':>6} {'steps/s':>8} {'sim s/s':>8} "
        f"{'physics':>8} {'observ.':>8} {'rest':>6} {'held':>6} {'reset':>9} "
        f"{'1st reset':>9} {'make':>9}"
    )
    for preset, boxes, wheeled in ROWS:
        found = measure(preset, boxes, wheeled, options.steps, options.observation)
        rest = 1.0 - found["physics"] - found["observation"]
        print(
            f"{preset:10} {boxes:5} {wheeled:6.0%} {found['rate']:8.0f} "
            f"{found['simulated']:8.0f} {found['physics']:8.0%} {found['observation']:8.0%} "
            f"{rest:6.0%} {found['held']:6.0%} {found['reset'] * 1e3:6.1f} ms "
            f"{found['first_reset'] * 1e3:6.0f} ms {found['make'] * 1e3:6.1f} ms"
        )


if __name__ == "__main__":
    main()
