"""The path of the world through the package in one decision of `gtsp-mpc`.

    python -m benchmarks.accuracy.call_path

The policy chooses its first command in a scene of area clearing. A profiler notes each function
that gets the world, or an object with the world in its field ``world``, once from each line that
calls it. Properties and compiled functions are not seen. Functions of one file in a row are a stay.
A return is a stay in a file that was left before.
"""

from __future__ import annotations

import sys
from functools import cached_property
from inspect import getattr_static
from pathlib import Path
from types import CodeType, FrameType

import numpy as np

import pushplan
from benchmarks.reporting import command_line, write
from pushplan.envs import make
from pushplan.planners import make_policy
from pushplan.scenarios import suite
from pushplan.world import World

PACKAGE = Path(pushplan.__file__).parent


class CallPath:
    """A profiler for `sys.setprofile`; ``stays`` has the file of each stay, in order."""

    def __init__(self) -> None:
        self._calls: set[tuple[CodeType, int, CodeType]] = set()
        self.stays: list[str] = []

    def __call__(self, frame: FrameType, event: str, argument: object) -> None:
        """Note a call if it passes the world on."""
        path = Path(frame.f_code.co_filename)
        caller = frame.f_back
        if event != "call" or caller is None or not path.is_relative_to(PACKAGE):
            return
        call = (caller.f_code, caller.f_lineno, frame.f_code)
        if call in self._calls or is_property(frame):
            return
        if any(holds_world(value) for value in frame.f_locals.values()):
            self._calls.add(call)
            if self.stays[-1:] != [path.relative_to(PACKAGE).as_posix()]:
                self.stays.append(path.relative_to(PACKAGE).as_posix())


def is_property(frame: FrameType) -> bool:
    owner = type(next(iter(frame.f_locals.values()), None))
    member = getattr_static(owner, frame.f_code.co_name, None)
    return isinstance(member, property | cached_property)


def holds_world(value: object) -> bool:
    return isinstance(value, World) or isinstance(getattr_static(value, "world", None), World)


def main() -> None:
    command_line(__doc__).parse_args()
    (scenario,) = suite("area-clearing-2d-10", episodes=1, first_seed=1000).scenarios
    env = make(scenario, observation="state")
    env.reset(seed=scenario.seed)
    world = env.world
    policy = make_policy("gtsp-mpc")
    policy.reset(world, np.random.default_rng(scenario.seed))
    path = CallPath()
    sys.setprofile(path)
    policy.act(world)
    sys.setprofile(None)
    count = len(path.stays)
    files = len(set(path.stays))
    write(*path.stays, f"{count} stays in {files} files, {count - files} returns")


if __name__ == "__main__":
    main()
