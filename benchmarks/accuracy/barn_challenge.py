"""Drives in the worlds of the BARN challenge, scored by its formula.

    python -m benchmarks.accuracy.barn_challenge FOLDER [--policies NAME ...] [--count N]

FOLDER holds worlds.npz and paths.npz as for `benchmarks.accuracy.real_maps`. A Jackal drives in
Pymunk, with a control step of 0.1 s: once with the whole map (*full*), and once with what a lidar
with 270 degrees and 10 m has seen by then (*lidar*); then the same with noise of 2 cm in its
distances and a tenth of its beams missing.

The score of a world is success times the optimal time over the time taken, which counts as 2 to 8
times the optimal one (Xiao et al., "Autonomous Ground Navigation in Highly Constrained Spaces",
2022): 0.5 at most. The optimal time is that of the reference path at 2 m/s; the goal is reached
within 1 m of it, and touching a cylinder, or 100 s, is a failure. Poses are exact and the robot
accelerates at up to 20 m/s^2, so scores are not those of the challenge, which runs in Gazebo.
"""

from __future__ import annotations

import contextlib
import itertools
import math
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.accuracy.real_maps import Case, barn_cases
from benchmarks.reporting import command_line, head, origin, percentiles, row, write
from pushplan.envs import PushEnv
from pushplan.evaluation import run_episode
from pushplan.planners import make_policy
from pushplan.scenarios import Scenario
from pushplan.world import jackal, save_world

_SPEED = 2.0  # of the optimal time [m/s]
_LIMIT_S = 100.0
_LIDAR = {"sensing": "lidar", "view_angle": math.radians(270.0), "view_range": 10.0}
SENSING = {
    "full": {},
    "lidar": _LIDAR,
    "noisy lidar": _LIDAR | {"range_noise": 0.02, "drop_out": 0.1},
}


class Outcome(NamedTuple):
    """Outcome of one world."""

    score: float
    success: bool
    hit: bool
    seconds: float  # simulated


def drive(case: Case, policy: str, sensing: str, folder: Path) -> Outcome:
    """Drive in a world, whose file is kept in a folder."""
    path = folder / f"{case.name}.yaml"
    if not path.exists():
        save_world(case.world, path)
    variations = {"world_file": str(path), "time_limit": _LIMIT_S, **SENSING[sensing]}
    with contextlib.closing(
        PushEnv(task="room", variations=variations, observation="state")
    ) as env:
        episode = run_episode(env, make_policy(policy), Scenario("room", variations=variations))
    optimal = (case.reference_m + case.world.goal.radius) / _SPEED
    taken = float(episode.times[-1])
    score = episode.success * optimal / min(max(taken, 2.0 * optimal), 8.0 * optimal)

    return Outcome(score, episode.success, episode.reason == "wall", taken)


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("folder", type=Path, help="of worlds.npz and paths.npz")
    parser.add_argument("--policies", nargs="+", default=["straight", "kinodynamic-rrt"])
    parser.add_argument("--count", type=int, help="of worlds; all by default")
    options = parser.parse_args()
    write(origin(), "")
    head("policy", "sensing", "worlds", "score", "success", "touched", "time p50 / worst [s]")
    with tempfile.TemporaryDirectory() as folder:
        for policy, sensing in itertools.product(options.policies, SENSING):
            cases = itertools.islice(barn_cases(options.folder, jackal()), options.count)
            found = [drive(case, policy, sensing, Path(folder)) for case in cases]
            row(
                f"`{policy}`",
                sensing,
                len(found),
                f"{np.mean([one.score for one in found]):.3f}",
                f"{np.mean([one.success for one in found]):.3f}",
                sum(one.hit for one in found),
                " / ".join(percentiles([one.seconds for one in found], (50, 100), 1)),
            )


if __name__ == "__main__":
    main()
