"""One page about a run that needs nothing beside it: tables, figures, every episode, replays."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

import pushplan
from pushplan.drawing.palette import FLOOR_PALETTE, SERIES
from pushplan.evaluation.report.tables import Table, heading
from pushplan.evaluation.statistics.stored_run import StoredRun
from pushplan.evaluation.store.provenance import in_words
from pushplan.evaluation.store.rows import ResultRow
from pushplan.files.output_files import make_folder, write_atomic
from pushplan.files.safe_files import read_bytes
from pushplan.imports.on_demand import need
from pushplan.metrics import METRICS, Role, metric_names
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
PAGE = "report.html"
REPLAYS = ("embed", "beside", "none")
_FILES = files("pushplan.evaluation.report") / "page_files"
_TIMES = ("plan_time_median_s", "decision_time_median_s", "wall_time_s")
_DIGITS = 5
_USUAL = {"make_env": "pushplan.envs:make", "observation": "auto"}
"""Facts of a run that say nothing."""


def write_page(
    run: StoredRun,
    tables: Sequence[Table],
    figures: Mapping[str, Path],
    folder: Path,
    *,
    replays: str = "embed",
    most: int = 40,
) -> Path:
    """Write ``report.html`` and return its path.

    Args:
        run: whose page it is.
        tables: tables, scores first.
        figures: caption -> SVG file; they are embedded.
        folder: where the page goes; links are relative to it.
        replays: one of `REPLAYS`: in the page, as files beside it, or not at all.
        most: how many episodes have a replay.
    """
    from markupsafe import Markup

    rows = [] if replays == "none" else chosen(run, most)
    texts: dict[str, str] = {}
    if replays == "embed":
        texts = {row.job: text for row in rows if (text := packed(run, row)) is not None}
    there = dict.fromkeys(texts, 1)
    if replays == "beside":
        there = dict.fromkeys(write_beside(run, rows, folder), 2)
    pairs = [table for table in tables if table.title.startswith("Paired")]
    configuration = run.about.get("configuration", {})
    facts = {"episodes": len(run.rows), **configuration}
    sources = run.about.get("policies", {})
    told = {key: value for key, value in facts.items() if value not in (None, _USUAL.get(key))}
    drawn = []
    for caption, file in figures.items():
        picture = file.read_text(encoding="utf-8")
        # without what stands before its root
        drawn.append((caption, file.name, Markup(picture[picture.index("<svg") :])))
    page = need("jinja2").Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    text = page.from_string(_file("page.html")).render(
        version=pushplan.__version__,
        title=f"pushplan: {configuration.get('suite') or 'results'}",
        facts=", ".join([*(f"{key} {value}" for key, value in told.items()), *run.remarks]),
        style=Markup(_file("page.css")),
        script=Markup(_file("page.js") + _file("replay.js") + "filter();\nchooseFirst();\n"),
        scores=[table for table in tables if table not in pairs],
        pairs=pairs,
        figures=drawn,
        sources=[(k, v) for k in run.policies if (v := sources.get(k, k)) != k],
        runs=[in_words(one) for one in run.about.get("runs", ())],
        data=Markup(_escaped(json.dumps(page_data(run, there), separators=(",", ":")))),
        replays=[Markup(_escaped(one)) for one in texts.values()],
    )
    path = folder / PAGE
    write_atomic(path, text.encode())
    return path


def is_page(path: Path) -> bool:
    """True if a file is a page that `write_page` wrote."""
    try:
        return b'name="generator" content="pushplan ' in read_bytes(path)[:400]
    except SchemaError:
        return False


def page_data(run: StoredRun, replays: Mapping[str, int]) -> dict[str, Any]:
    """Return the rows for the scripts of the page, column by column, texts as indices of a list.

    Args:
        run: the rows.
        replays: job -> 1 for a replay in the page, 2 for one beside it.
    """
    policies = run.policies
    settings = list(run.titles)
    listed = {row.scenario: (settings.index(row.setting), row.seed) for row in run.rows}
    scenarios = {scenario: i for i, scenario in enumerate(listed)}
    reasons = {reason: i for i, reason in enumerate(dict.fromkeys(r.reason for r in run.rows))}
    statuses = list(dict.fromkeys(row.status for row in run.rows))
    values = _values(run)
    headings = {name: heading(name) for name in values if name in METRICS}
    headings |= {name: name.removesuffix("_s") + " [s]" for name in _TIMES}
    outcomes = []
    for row in run.rows:
        if row.failed:
            outcomes.append(row.status)
        else:
            outcomes.append("success" if row.success else row.reason)
    shown = {"outcome": outcomes, **values}
    return {
        "folder": str(run.path) if run.path is not None else "DIR",
        "policies": policies,
        "colours": _colours(),
        "settings": list(run.titles.values()),
        "scenarios": [(scenario, *where) for scenario, where in listed.items()],
        "statuses": statuses,
        "reasons": list(reasons),
        "measures": [(name, headings.get(name, name)) for name in shown],
        "rows": {
            "policy": [policies.index(row.policy) for row in run.rows],
            "scenario": [scenarios[row.scenario] for row in run.rows],
            "status": [statuses.index(row.status) for row in run.rows],
            "reason": [reasons[row.reason] for row in run.rows],
            "success": [int(row.success) for row in run.rows],
            "job": [row.job for row in run.rows],
            "trace": [row.trace for row in run.rows],
            "replay": [replays.get(row.job, 0) for row in run.rows],
            "values": shown,
        },
    }


def _colours() -> dict[str, Any]:
    """The palette of figures and films, for replays and the names of policies."""
    names = ("wall", "robot", "trail", "plan", "ghost", "prediction", "robot_edge")
    return {
        "policies": SERIES,
        **{name: getattr(FLOOR_PALETTE, name) for name in names},
        "goal": FLOOR_PALETTE.goal[1],
        "object": FLOOR_PALETTE.box[0],
        "edge": FLOOR_PALETTE.box[1],
    }


def _values(run: StoredRun) -> dict[str, list[float | None]]:
    """Columns that have values, rounded, and metrics that are no columns."""
    names = (*metric_names(Role.SCORE, Role.DETAIL, Role.FACT), *_TIMES)
    own = {name: [getattr(row, name) for row in run.rows] for name in names}
    filled = {name: column for name, column in own.items() if set(column) != {None}}
    return {
        name: [None if value is None else float(f"{value:.{_DIGITS}g}") for value in column]
        for name, column in {**filled, **run.measured_columns}.items()
    }


def _file(name: str) -> str:
    return (_FILES / name).read_text(encoding="utf-8")


def _escaped(text: str) -> str:
    """JSON that ends no script element: the characters of tags as their codes."""
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text


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
