"""How fast policies are trained: ``python -m benchmarks.speed.policy_training [NAME ...]``.

For each shipped configuration: decisions a second of processor time, of the environment alone with
random actions and of the whole training (one process, one thread, without validation), and what the
whole training takes by that. Processor time does not depend on what else the machine does, apart
from its caches and clock.
"""

from __future__ import annotations

import logging
import sys
import tempfile
import time

import numpy as np

from benchmarks.reporting import command_line
from pushplan.training.policies.config import TrainingConfig, read_config, shipped_configs
from pushplan.training.policies.environment import TrainingEnv

LEAST_S = 4.0
"""Processor time for which each environment is driven."""


def environment_speed(config: TrainingConfig) -> float:
    """Decisions a second of an environment, resets included."""
    env = TrainingEnv(config)
    env.action_space.seed(0)
    env.reset(seed=0)
    for _ in range(3):
        _step(env)
    began = time.process_time()
    steps = 0
    while time.process_time() - began < LEAST_S:
        _step(env)
        steps += 1
    return steps / (time.process_time() - began)


def _step(env: TrainingEnv) -> None:
    action = env.action_space.sample()
    if isinstance(action, np.ndarray) and env.action.mode == "turn_rate":
        action = 0.3 * action  # or it circles
    _, _, terminated, truncated, _ = env.step(action)
    if terminated or truncated:
        env.reset()


def training_speed(config: TrainingConfig) -> float:
    """Decisions a second of the training, in its second chunk, where everything is at work."""
    from pushplan.training.policies.training import train_policy

    options = config.to_dict()["options"]
    if config.algorithm == "ppo":
        chunk = config.envs * options["rollout"]
    else:
        chunk = 300 if config.algorithm == "sam" else 1200
        options["first"] = chunk // 2
        options["buffer"] = 4 * chunk
    data = {**config.to_dict(), "options": options, "chunk": chunk, "steps": 2 * chunk}
    short = TrainingConfig.from_dict({**data, "validation": 0})
    times: list[float] = []

    def until(chunks: int) -> bool:
        times.append(time.process_time())
        return False

    with tempfile.TemporaryDirectory() as folder:
        train_policy(short, folder, device="cpu", until=until)
        ended = time.process_time()
    return chunk / (ended - times[1])


def main() -> int:
    """Print the table."""
    parser = command_line(__doc__)
    known = {k: v for k, v in shipped_configs().items() if not k.endswith("-bc")}
    parser.add_argument("names", nargs="*", default=sorted(known), metavar="NAME")
    options = parser.parse_args()
    logging.disable()
    sys.stdout.write(
        "| configuration | decisions | environment alone, decisions/s | training, decisions/s "
        "| hours on one core |\n|---|---|---|---|---|\n"
    )
    for name in options.names:
        config = read_config(known[name])
        alone = environment_speed(config)
        together = training_speed(config)
        hours = config.steps / together / 3600.0
        sys.stdout.write(
            f"| {name} | {config.steps:,} | {alone:.0f} | {together:.0f} | {hours:.2f} |\n"
        )
        sys.stdout.flush()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
