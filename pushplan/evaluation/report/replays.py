"""Recorded episodes, packed small enough for a page."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pushplan.evaluation.statistics.stored_run import StoredRun
from pushplan.evaluation.store.rows import ResultRow
from pushplan.files.output_files import make_folder, write_atomic
from pushplan.world import Episode, GoalDisc, GoalLine, GoalPose, SchemaError
from pushplan.world.checks import FloatArray
from pushplan.world.stored.recorded_plans import thinned

FRAMES = 400
"""At most so many instants of an episode are kept."""
PATH = 24
"""Of the path of a plan, at most so many points are kept."""
# steps in which poses are kept [m], [rad]
_LENGTH = 1e-3
_ANGLE = 1e-3
_MOST = 2**15 - 1


def chosen(run: StoredRun, most: int) -> list[ResultRow]:
    """The episodes to show: whole scenarios, those with failures first, ``most`` episodes at most.

    Args:
        run: rows and their folder.
        most: how many.
    """
    groups: dict[str, list[ResultRow]] = {}
    for row in run.rows:
        if row.trace:
            groups.setdefault(row.scenario, []).append(row)

    def order(rows: Sequence[ResultRow]) -> tuple[bool, bool, int]:
        return (not any(r.failed for r in rows), all(r.success for r in rows), rows[0].seed)

    found: list[ResultRow] = []
    for rows in sorted(groups.values(), key=order):
        if len(found) + len(rows) > most:
            break
        found += rows
    return found


def packed(run: StoredRun, row: ResultRow) -> str | None:
    """The episode of a row as JSON text; None if there is none that can be read.

    Poses are kept in steps of 1 mm and 1 mrad as differences from frame to frame, deflated.
    """
    try:
        episode = run.episode(row)
    except SchemaError:
        return None
    if episode is None:
        return None
    scene = _scene(episode)
    motion = _motion(episode)
    return json.dumps({"job": row.job, **scene, **motion, "plans": _plans(episode)})


def write_beside(run: StoredRun, rows: Sequence[ResultRow], folder: Path) -> set[str]:
    """Write ``replays/JOB.js`` for each row; a page on a disk may load scripts, but no data.

    Returns:
        The jobs of which there is one.
    """
    there = folder / "replays"
    make_folder(there)
    written = set()
    for row in rows:
        if (text := packed(run, row)) is not None:
            write_atomic(there / f"{row.job}.js", f"pushplanReplay({text});\n".encode())
            written.add(row.job)
    return written


def _scene(episode: Episode) -> dict[str, Any]:
    """Return the static obstacles and the goal, and the outlines of what moves."""
    world = episode.world
    goal = world.goal
    objects = world.movables
    if isinstance(goal, GoalDisc):
        shown = {"kind": "disc", "center": _flat(goal.center), "radius": goal.radius}
        if isinstance(goal, GoalPose):
            shown["heading"] = goal.heading
    elif isinstance(goal, GoalLine):
        shown = {"kind": "line", "point": _flat(goal.point), "normal": _flat(goal.normal)}
    else:
        shown = {"kind": "polygons", "parts": [_flat(part) for part in world.goal_polygons]}
    segments = np.column_stack([world.static.segments, world.static.radii])
    return {
        "bounds": _flat(world.static.bounds),
        "walls": [_flat(polygon) for polygon in world.static.polygons],
        "segments": [_flat(segment) for segment in segments],
        "goal": shown,
        "robot": [_flat(part) for part in world.robot.contact_parts],
        # the polygons that are filled for an object, and the lines around them
        "objects": [
            {name: [_flat(one) for one in getattr(objects, name)(k)] for name in ("parts", "rings")}
            for k in range(len(objects))
        ],
    }


def _motion(episode: Episode) -> dict[str, Any]:
    count = len(episode.times)
    kept = thinned(count, FRAMES)
    poses = np.concatenate([episode.robot_poses[:, None], episode.object_poses], axis=1)[kept]
    poses[..., 2] = np.unwrap(poses[..., 2], axis=0)
    leaps = np.abs(np.diff(poses, axis=0)).max(axis=(0, 1), initial=0.0)
    scales = np.maximum([_LENGTH, _LENGTH, _ANGLE], leaps / (_MOST - 1.0))
    steps = np.round(poses / scales).astype(np.int64)
    lines = steps.transpose(1, 2, 0).reshape(-1, len(kept))  # a line for each coordinate
    data = lines[:, 0].astype("<i4").tobytes() + np.diff(lines).astype("<i2").tobytes()
    return {
        "times": np.round(episode.times[kept] - episode.times[0], 3).tolist(),
        "bodies": poses.shape[1],
        "frames": len(kept),
        "scales": scales.tolist(),
        "packed": base64.b64encode(zlib.compress(data, 9)).decode(),
    }


def _plans(episode: Episode) -> list[dict[str, Any]]:
    """When each plan was taken up, its path, and where it expects which objects at its end."""
    plans = episode.plans
    found = []
    if plans is None:
        return []
    for index in thinned(len(plans), FRAMES).tolist():
        path = plans.path(index)
        (moved, poses) = plans.expected(index)
        kept = thinned(len(path), PATH)
        time = round(float(plans.times[index] - episode.times[0]), 3)
        way = _flat(path[kept, :2])
        found.append({"time": time, "path": way, "moved": moved.tolist(), "ends": _flat(poses)})
    return found


def _flat(points: FloatArray) -> list[float]:
    return [round(float(value), 3) for value in np.asarray(points).ravel()]
