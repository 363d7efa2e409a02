"""Outlines that would take long: every door answers within the time and memory of a short one."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import shapely

from pushplan.perception import ObjectTracker
from pushplan.scenarios import load_ice
from pushplan.serving.world_feed import WorldFeed
from pushplan.world import (
    InvalidInputError,
    Movables,
    PushplanError,
    Receptacle,
    RobotModel,
    StaticMap,
    load_world,
    world_to_dict,
)
from tests.conftest import make_u_maze

CPU_S = 8.0
"""Most for a bomb of up to 1 MB; 0.3.0 takes 17 s for the first one."""
MEMORY_MB = 250


def star(count: int, inner: np.ndarray | float) -> np.ndarray:
    angles = 2.0 * np.pi * np.arange(count) / count
    radii = np.where(np.arange(count) % 2, inner, 1.0)
    return radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])


def scribble(count: int) -> np.ndarray:
    return np.random.default_rng(0).random((count, 2))


def comb(count: int) -> np.ndarray:
    """Long slanting teeth, the boxes around which all meet."""
    x = np.linspace(0.0, 0.5, count)
    y = np.where(np.arange(count) % 2, 1.0, 0.1)
    return np.vstack([np.column_stack([x + y, y]), [[0.55, -0.2], [-0.2, -0.2]]])


BOMBS = {
    "scribble": scribble(2_000),
    "long scribble": scribble(25_000),
    "corners that repeat": np.tile(star(4, 1.0), (25_000, 1)),
    "scribble that repeats": np.tile(scribble(90), (100, 1)),
    "random star": star(3_000, np.random.default_rng(0).uniform(0.3, 1.0, 3_000)),
    "spikes": star(3_000, 0.3),
    "comb": comb(2_000),
    "circle with a dent": np.vstack([star(50_000, 1.0)[1:], [[0.5, 0.0]]]),
}


def in_a_message(corners: np.ndarray) -> None:
    data = world_to_dict(make_u_maze())
    data["static"]["polygons"] = [corners.tolist()]
    WorldFeed().whole(data)


def in_a_file(corners: np.ndarray, folder: Path) -> None:
    data = world_to_dict(make_u_maze())
    data["movables"] = [{"polygon": corners.tolist()}]
    path = folder / "world.json"
    path.write_text(json.dumps(data))
    load_world(path)


def in_ice(corners: np.ndarray, folder: Path) -> None:
    path = folder / "ice.json"
    path.write_text(json.dumps([corners.tolist()]))
    load_ice(path)


LIMITS = {"mass": 1, "drive": "differential", "max_speed": 1, "max_turn_rate": 1}
DOORS = {
    "world file": in_a_file,
    "message": lambda c, _: in_a_message(c),
    "ice file": in_ice,
    "polygons": lambda c, _: Movables.from_polygons([c]),
    "polygon of Shapely": lambda c, _: Movables.from_polygons([shapely.Polygon(c)]),
    "map": lambda c, _: StaticMap.build([c]),
    "robot": lambda c, _: RobotModel.from_outline(c, **LIMITS),
    "goal": lambda c, _: Receptacle(c),
    "tracker": lambda c, _: ObjectTracker().update([c], 0.0),
}  # fmt: skip


@pytest.mark.parametrize("name", DOORS)
def test_a_door_takes_no_longer_than_a_bomb_is_large(name: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tests.doors.test_outline_bombs", name, str(tmp_path)],
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (10 + 8 * len(BOMBS),) * 2),
        cwd=Path(__file__).parents[2],
    )
    assert done.returncode == 0, done.stdout[-500:] + done.stderr[-1500:]


def _usage() -> tuple[float, float]:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0


def main(name: str, folder: str) -> None:
    warnings.simplefilter("ignore")
    for label, corners in BOMBS.items():
        before = _usage()
        try:
            DOORS[name](corners, Path(folder))
        except PushplanError as error:
            assert len(str(error).splitlines()) == 1
        seconds, megabytes = np.subtract(_usage(), before)
        assert seconds < CPU_S, f"{label}: {seconds:.1f} s"
        assert megabytes < MEMORY_MB, f"{label}: {megabytes:.0f} MB"


def test_a_refusal_names_the_polygon_its_corners_and_crossings() -> None:
    text = r"static.polygons 1 with 2,000 corners is too tangled: at least [\d,]{5,} crossings"
    with pytest.raises(InvalidInputError, match=text):
        StaticMap.build([star(4, 1.0).tolist(), scribble(2_000).tolist()])


def test_objects_of_crossing_parts_are_bounded_too() -> None:
    y = np.arange(1_000)[:, None] * 1e-3
    bars = np.stack(np.broadcast_arrays(0, y, 1, 1 - y, 1, 1.0001 - y, 0, y + 1e-4), axis=-1)
    with pytest.raises(InvalidInputError, match="an object of 1,000 parts"):
        Movables.from_polygons([list(bars.reshape(-1, 4, 2))])


if __name__ == "__main__":
    main(*sys.argv[1:])
