"""How many steps a second the environments take with image observations, and where time goes.

Usage::

    python -m benchmarks.speed.environment_throughput [--seconds 4] [--only mujoco]
    python -m benchmarks.speed.environment_throughput --memory
    python -m benchmarks.speed.environment_throughput --vector

Each row drives one environment with the same kind of actions: a gentle weave for turn rates and
velocities, random headings for headings. A new episode starts where one ends, after 100 steps, and
where the robot has been held for 5 steps; resets are timed apart. Shares are measured by wrapping
the simulator and the observation builder of the environment in timers. The first episode, in which
kernels are loaded and distance fields are computed, is not counted; what it costs stands in the
last columns. ``bridges/bench_push/throughput.py`` sets the original beside it, in turns.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from benchmarks.reporting import command_line


@dataclass(frozen=True)
class Row:
    """One environment, with the wanted steps/s."""

    task: str
    simulator: str
    action: str
    variations: Mapping[str, Any] = field(default_factory=dict)
    target: float = float("nan")
    simulated: bool = False  # rates are simulated seconds a second

    @property
    def name(self) -> str:
        """In words."""
        extra = " ".join(f"{key} {value}" for key, value in self.variations.items())
        return f"{self.task} {self.simulator} {self.action} {extra}"


ROWS = (
    Row("maze", "pymunk", "turn_rate", {"boxes": 5}, 1000),
    Row("maze", "pymunk", "turn_rate", {"boxes": 10}, 900),
    Row("maze", "pymunk", "turn_rate", {"boxes": 10, "wheeled": 0.5}),
    Row("ship_ice", "pymunk", "turn_rate", {"concentration": 0.1}, 450),
    Row("ship_ice", "pymunk", "turn_rate", {"concentration": 0.3}),
    Row("ship_ice", "pymunk", "turn_rate", {"concentration": 0.5}, 60),
    Row("box_delivery", "pymunk", "heading", {}, 150),
    Row("box_delivery", "pymunk", "heading", {"layout": "large_columns"}),
    Row("box_delivery", "pymunk", "velocity", {}),
    Row("area_clearing", "pymunk", "heading", {}, 500),
    Row("area_clearing", "pymunk", "velocity", {}, 1500),
    Row("maze", "mujoco", "turn_rate", {"boxes": 3}, 500),
    Row("box_delivery", "mujoco", "heading", {}, 120),
    Row("area_clearing", "mujoco", "heading", {}, 200),
    Row("ship_ice", "mujoco", "turn_rate", {"concentration": 0.1}, 40, simulated=True),
    Row("ship_ice", "mujoco", "turn_rate", {"concentration": 0.5}, 10, simulated=True),
)
COUNT = 16  # environments in a vector
VECTOR = (ROWS[1], ROWS[4], ROWS[9], ROWS[11])


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


def make(row: Row) -> Any:
    """The environment of a row, as `gymnasium.make` would make it."""
    from pushplan.envs.push_env import PushEnv

    return PushEnv(
        task=row.task,
        simulator=row.simulator,
        action=row.action,
        variations=row.variations,
        observation="image",
    )


def driver(row: Row) -> Callable[[int], Any]:
    """Actions by step."""
    rng = np.random.default_rng(0)
    if row.action == "turn_rate":
        return lambda i: np.array([0.6 * np.sin(i / 9.0)], dtype=np.float32)
    if row.action == "velocity":
        return lambda i: np.array([1.0, 0.6 * np.sin(i / 35.0)], dtype=np.float32)
    return lambda i: rng.uniform(-0.5, 0.5, 1).astype(np.float32)


def measure(row: Row, seconds: float) -> dict[str, float]:
    """Steps/s and shares of one environment."""
    begin = time.perf_counter()
    env = make(row)
    made = time.perf_counter() - begin
    begin = time.perf_counter()
    env.reset(seed=0)
    first_reset = time.perf_counter() - begin
    act = driver(row)
    for i in range(3):
        env.step(act(i))
    physics = Stopwatch()
    seeing = Stopwatch()
    env._simulator.step = physics.wrap(env._simulator.step)
    env._builder = TimedBuilder(env._builder, seeing)
    stepping = 0.0
    simulated = 0.0
    resets = []
    held = 0
    over = True
    stuck = 0
    age = 0
    i = 0
    while stepping < seconds:
        if over:
            seen = seeing.seconds
            begin = time.perf_counter()
            env.reset(seed=1 + len(resets))
            resets.append(time.perf_counter() - begin)
            seeing.seconds = seen
            stuck = 0
            age = 0
        action = act(i)
        clock = env.world.time
        begin = time.perf_counter()
        *_, terminated, truncated, info = env.step(action)
        stepping += time.perf_counter() - begin
        simulated += env.world.time - clock
        held += info["held"]
        stuck = stuck + 1 if info["held"] else 0
        age = age + 1
        i = i + 1
        over = terminated or truncated or stuck == 5 or age == 100
    return {
        "rate": i / stepping,
        "simulated": simulated / stepping,
        "physics": physics.seconds / stepping,
        "observation": seeing.seconds / stepping,
        "held": held / i,
        "reset": float(np.median(resets)),
        "first_reset": first_reset,
        "make": made,
    }


def throughput(seconds: float, only: str) -> None:
    """The table of rates."""
    print(
        f"{'environment':58} {'steps/s':>8} {'sim s/s':>8} {'target':>7} "
        f"{'physics':>8} {'observ.':>8} {'rest':>6} {'held':>6} {'reset':>9} "
        f"{'1st reset':>9} {'make':>9}"
    )
    for row in ROWS:
        if only not in row.name:
            continue
        found = measure(row, seconds)
        rest = 1.0 - found["physics"] - found["observation"]
        print(
            f"{row.name:58} {found['rate']:8.0f} {found['simulated']:8.0f} "
            f"{row.target:7.0f} "
            f"{found['physics']:8.0%} {found['observation']:8.0%} "
            f"{rest:6.0%} {found['held']:6.0%} {found['reset'] * 1e3:6.1f} ms "
            f"{found['first_reset'] * 1e3:6.0f} ms {found['make'] * 1e3:6.1f} ms",
            flush=True,
        )


def resident() -> float:
    """Memory of this process [MB]."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def memory(only: str, count: int = 20) -> None:
    """Memory of one more environment of a kind that is in use already."""
    for row in ROWS:
        if only not in row.name:
            continue
        first = make(row)
        first.reset(seed=0)
        first.step(driver(row)(0))
        before = resident()
        kept = []
        for seed in range(count):
            env = make(row)
            env.reset(seed=seed)
            env.step(driver(row)(0))
            kept.append(env)
        print(f"{row.name:58} {(resident() - before) / count:8.2f} MB each")


def step_together(envs: Any, actions: Sequence[Any]) -> float:
    """Time [s] of steps of environments that wait for each other."""
    envs.reset(seed=1)
    begin = time.perf_counter()
    for action in actions:
        envs.step(np.stack([action] * COUNT))
    return time.perf_counter() - begin


def step_apart(envs: Any, actions: Sequence[Any]) -> float:
    """Time [s] of the same steps where the environments of a worker do not wait for the others."""
    envs.async_reset(seed=1)
    batches = [envs.recv()[-1]["env_id"] for _ in range(envs.workers)]
    done = dict.fromkeys((batch[0] for batch in batches), 0)
    owed = 0
    begin = time.perf_counter()
    while True:
        for batch in batches:
            if done[batch[0]] < len(actions):
                envs.send(np.stack([actions[done[batch[0]]]] * len(batch)), batch)
                done[batch[0]] += 1
                owed += 1
        if not owed:
            return time.perf_counter() - begin
        batches = [envs.recv()[-1]["env_id"]]
        owed -= 1


def vector(seconds: float, only: str) -> None:
    """The same steps of 16 environments in one worker process and in two, in turns."""
    from pushplan.envs import WorkerVectorEnv

    for row in VECTOR:
        if only not in row.name:
            continue
        make_all = partial(WorkerVectorEnv, [partial(make, row)] * COUNT)
        one = make_all(workers=1)
        two = make_all(workers=2)
        act = driver(row)
        actions = [act(i) for i in range(100)]
        for envs in (one, two):
            step_together(envs, actions[:3])
        turns = max(1, round(seconds / step_together(one, actions)))
        kinds = (one, step_together), (two, step_together), (two, step_apart)
        times = sum(np.array([run(envs, actions) for envs, run in kinds]) for _ in range(turns))
        alone, together, apart = turns * COUNT * len(actions) / times
        print(
            f"{row.name:45} one worker {alone:6.0f} steps/s, two {together:6.0f} "
            f"({together / alone:.2f}), without waiting {apart:6.0f} ({apart / alone:.2f})",
            flush=True,
        )
        one.close()
        two.close()


def main() -> None:
    """Measure what was asked for."""
    parser = command_line(__doc__)
    parser.add_argument("--seconds", type=float, default=4.0, help="of stepping for each row")
    parser.add_argument("--only", default="", help="rows whose name holds this text")
    parser.add_argument("--memory", action="store_true", help="memory of an environment instead")
    parser.add_argument("--vector", action="store_true", help="gain of two workers instead")
    options = parser.parse_args()
    if options.memory:
        memory(options.only)
    elif options.vector:
        vector(options.seconds, options.only)
    else:
        throughput(options.seconds, options.only)


if __name__ == "__main__":
    main()
