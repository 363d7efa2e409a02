"""Worlds that many tests start from, and what the markers do."""

from __future__ import annotations

import contextlib
import gc
import os
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import hypothesis
import numpy as np
import pytest

import pushplan
from pushplan.world import Drive, GoalDisc, Movables, PlanStatus, RobotModel, StaticMap, World

# for tests of benchmarks; at the end, so that an installed pushplan comes before the checkout
sys.path.append(str(Path(__file__).parents[1]))

# a shared machine has no speed
hypothesis.settings.register_profile("busy", deadline=None, max_examples=40)
hypothesis.settings.load_profile("busy")

LEARN = ("torch", "stable_baselines3", "onnx", "minari", "h5py", "tensorboard")
MISSING = [name for name in LEARN if find_spec(name) is None]

SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
OCTAGON = np.array(
    [
        [0.7, 0.3],
        [0.4, 0.6],
        [-0.4, 0.6],
        [-0.7, 0.3],
        [-0.7, -0.3],
        [-0.4, -0.6],
        [0.4, -0.6],
        [0.7, -0.3],
    ]
)


def make_robot(**changes: object) -> RobotModel:
    limits: dict[str, object] = {
        "mass": 1.0,
        "drive": Drive.CONSTANT_SPEED,
        "max_speed": 0.15,
        "max_turn_rate": 0.105,
    }
    limits.update(changes)
    return RobotModel.from_outline(OCTAGON, **limits)


def make_boxes(poses: object) -> Movables:
    """Square boxes of 1 m at the given (K, 3) poses."""
    at = np.asarray(poses, dtype=float).reshape(-1, 3)
    return Movables.from_outlines([SQUARE] * len(at), at)


def make_u_maze(box_poses: object = (), **changes: object) -> World:
    """The U-shaped maze of the 2D benchmark."""
    walls = [
        [0, 0, 15, 0],
        [0, 0, 0, 15],
        [15, 0, 15, 15],
        [0, 15, 15, 15],
        [7.5, 0, 7.5, 10],
    ]
    fields: dict[str, object] = {
        "robot": make_robot(),
        "robot_pose": [11.25, 3.75, np.pi / 2],
        "static": StaticMap.build(segments=walls, radii=0.5),
        "movables": make_boxes(box_poses),
        "goal": GoalDisc([3.75, 3.75], 1.86),
    }
    fields.update(changes)
    return World(**fields)  # type: ignore[arg-type]


def solved_by(name: str) -> tuple[PlanStatus, ...]:
    """What a planner says of a plan that arrives; those for a point may know only a path."""
    paths = ("straight", "skeleton", "geometric-rrt")
    return (PlanStatus.SOLVED, *((PlanStatus.PATH_ONLY,) if name in paths else ()))


def scattered_boxes(count: int, seed: int) -> np.ndarray:
    """(count, 3) poses in the U-maze that overlap neither each other nor walls nor the start."""
    rng = np.random.default_rng(seed)
    found: list[np.ndarray] = []
    while len(found) < count:
        spot = rng.uniform(1.3, 13.7, 2)
        wall = abs(spot[0] - 7.5) < 1.3 and spot[1] < 11.3
        crowded = any(np.hypot(*(spot - other[:2])) < 1.45 for other in found)
        near_ends = any(np.hypot(*(spot - end)) < 1.9 for end in ([11.25, 3.75], [3.75, 3.75]))
        if not (wall or crowded or near_ends):
            found.append(np.array([*spot, 0.0]))
    return np.array(found).reshape(-1, 3)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let a command ask for more random worlds."""
    parser.addoption("--worlds", type=int, help="number of worlds of tests over random worlds")


def pytest_configure(config: pytest.Config) -> None:
    """Let the tests' processes find this package, and no other copy of it."""
    if not hasattr(config, "workerinput"):  # of xdist
        os.environ["PYTHONSAFEPATH"] = "1"  # else a checkout that one works in counts
        first = [str(Path(pushplan.__file__).parents[1]), os.environ.get("PYTHONPATH", "")]
        os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, first))
        if getattr(config.option, "numprocesses", None) and not sys.dont_write_bytecode:
            rewrite_asserts(config)


def rewrite_asserts(config: pytest.Config) -> None:
    """Let pytest rewrite the asserts of test files once, before each worker does so for itself.

    That takes most of the time of a first collection. It calls what pytest does not promise to
    keep: where that has changed, the workers do it as ever.
    """
    ours = Path(__file__).parent
    named = {Path(one.partition("::")[0]).absolute() for one in config.args}
    with contextlib.suppress(Exception):  # a file that is no Python, say: its worker reports it
        from _pytest.assertion import rewrite

        state = config.stash[rewrite.assertstate_key]
        for file in ours.rglob("test_*.py"):
            if named.isdisjoint({file, *file.parents}):
                continue
            folder = rewrite.get_cache_dir(file)
            cached = folder / f"{file.stem}{rewrite.PYC_TAIL}"
            if rewrite._read_pyc(file, cached) is None and rewrite.try_makedirs(folder):
                version, code = rewrite._rewrite_test(file, config)
                rewrite._write_pyc(state, code, version, cached)


def pytest_collection_finish() -> None:
    """Collect garbage more rarely: what is imported stays, and is gone through."""
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip what needs the extra 'learn' where it is missing."""
    if "learn" in item.keywords and MISSING:
        pytest.skip(f"needs the extra 'learn' ({', '.join(MISSING)})")


def quickest(call: Callable[[], object], tries: int = 3) -> float:
    """Least processor time of some calls [s], as a free machine would need.

    A loop that takes 1.5 ms on a free machine runs beside each call; where it takes longer, the
    machine is slow or busy, and the time of the call shrinks by the same factor.
    """

    def yardstick() -> None:
        total = 0
        for number in range(20_000):
            total += number * number % 7

    times, beside = [], []
    for _ in range(tries):
        for work, taken in ((yardstick, beside), (call, times), (yardstick, beside)):
            began = time.process_time()
            work()
            taken.append(time.process_time() - began)
    return min(times) * min(1.0, 1.5e-3 / min(beside))


@pytest.fixture
def cpu_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the clock of deadlines count this process's work, so that other work changes nothing."""
    monkeypatch.setattr(time, "perf_counter", time.process_time)


def leave_figures_empty(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let reports have empty figures: drawing takes longer than all the rest of a report."""
    from matplotlib.figure import Figure

    monkeypatch.setattr("pushplan.evaluation.report.plots.draw", lambda run, name: Figure())


@pytest.fixture
def empty_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same for a test that is about something else."""
    leave_figures_empty(monkeypatch)


@pytest.fixture
def u_maze() -> World:
    return make_u_maze([[4, 9, 0.3], [10, 12, 0.0], [13, 8, 0.7]])
