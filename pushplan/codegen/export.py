"""Controllers written as C: sources, header, example and a page that explains them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pushplan import __version__
from pushplan.codegen.memory import MemoryStruct
from pushplan.codegen.program import Program
from pushplan.control.mpc.kernels import Track
from pushplan.control.mpc.mpc_config import MpcConfig
from pushplan.control.mpc.tracker import tracker_memory
from pushplan.control.mpc.tracker_kernels import begin_track, track_step
from pushplan.geometry.obstacles import Obstacles
from pushplan.planners.pushing.problem import pushing_horizon, pushing_memory
from pushplan.planners.pushing.push_kernels import begin_push, push_step
from pushplan.planners.pushing.pushing_config import PushingConfig
from pushplan.world import Drive, InvalidInputError, RobotModel
from pushplan.world.checks import FloatArray, expect

CONTROLLERS = ("pushing-mpc", "tracking-mpc")
"""What can be written as C."""

_HERE = Path(__file__).parent
_TRACK = Track(np.zeros((2, 3)), np.zeros(2), np.zeros(2))
_MAP = Obstacles(np.zeros((2, 2)), np.zeros(2, np.int64), np.zeros(1), np.zeros((1, 4)))
_POSE = "{(double *)pose, 3}"


def write_tracking_mpc(
    folder: str | Path, robot: RobotModel, config: MpcConfig | None = None
) -> list[Path]:
    """Write `MpcTracker` as C.

    Args:
        folder: where to; made if it is missing.
        robot: its limits, which become initial parameters.
        config: parameters.

    Returns:
        The files: header, source, example, README.
    """
    expect("robot", robot, RobotModel)
    config = MpcConfig() if config is None else expect("config", config, MpcConfig)
    memory = tracker_memory(robot, config)
    program = Program()
    begin = program.add(begin_track, [memory])
    pose, out = np.zeros(3), np.zeros(2)
    step = program.add(track_step, [memory, _TRACK, pose, 0.0, 0.0, out])
    parts = {
        "NAME": "tracking_mpc",
        "TITLE": "Model-predictive tracking of a path",
        "POSES": "",
        "POSES_DOC": "",
        "MAP": "",
        "OBSTACLES": "",
        "INPUTS": ", const double pose[3]",
        "BOX_DOC": "",
        "BEGIN": f"{begin}(&memory);",
        "LOCALS": f"        const doubles here = {_POSE};\n",
        "STEP": f"{step}(&memory, &track, here, time, self->held, out);",
        "EXAMPLE_BEGIN": "    tracking_mpc_begin(&controller);",
        "EXAMPLE_STEP": "        tracking_mpc_step(&controller, &path, i * period, pose, command);",
        "START": "0.0",
    }
    return _write(folder, program, memory, parts, robot, config.period)


def write_pushing_mpc(
    folder: str | Path,
    robot: RobotModel,
    outline: FloatArray,
    config: PushingConfig | None = None,
) -> list[Path]:
    """Write `PushingMpc` as C.

    Args:
        folder: where to; made if it is missing.
        robot: that pushes, a differential drive; its limits become initial parameters.
        outline: (N, 2) convex, counter-clockwise corners of the box, origin at the centroid [m].
        config: parameters.

    Returns:
        The files: header, source, example, README.

    Raises:
        InvalidInputError: if the robot cannot stop, or the outline is not such a one.
    """
    if expect("robot", robot, RobotModel).drive is not Drive.DIFFERENTIAL:
        raise InvalidInputError("pushing along a path needs a differential drive")
    config = PushingConfig() if config is None else expect("config", config, PushingConfig)
    memory, models = pushing_memory(robot, outline, config, pushing_horizon(robot, config))
    program = Program()
    begin = program.add(begin_push, [memory, 0.0])
    pose, box, out = np.zeros(3), np.zeros(3), np.zeros(2)
    step = program.add(push_step, [memory, _TRACK, _MAP, pose, box, 0.0, 0.0, out])
    reach = repr(models[0].reach)
    indent = " " * 8
    parts = {
        "NAME": "pushing_mpc",
        "TITLE": "Model-predictive pushing of a box along a path",
        "POSES": ", const double pose[3], const double box[3]",
        "POSES_DOC": " Of robot and box\n   now: the face that the robot looks at is pushed.",
        "MAP": ", const pushing_mpc_obstacles *obstacles",
        "OBSTACLES": (_HERE / "obstacles.h").read_text(encoding="utf-8"),
        "INPUTS": ", const double pose[3],\n    const double box[3]",
        "BOX_DOC": "\n   box: pose of the box; the path is the box's. obstacles may be NULL.",
        "BEGIN": f"{begin}(&memory, pose[2] - box[2]);",
        "LOCALS": (_HERE / "pushing_locals.c").read_text(encoding="utf-8"),
        "STEP": f"{step}(&memory, &track, &map, here, there, time, self->held, out);",
        "EXAMPLE_BEGIN": f"    double box[3] = {{{reach}, 0.0, 0.0}};\n"
        "    pushing_mpc_begin(&controller, pose, box);",
        "EXAMPLE_STEP": f"{indent}/* the box lies on the bumper and moves with the robot */\n"
        f"{indent}box[0] = pose[0] + {reach} * cos(pose[2]);\n"
        f"{indent}box[1] = pose[1] + {reach} * sin(pose[2]);\n"
        f"{indent}box[2] = pose[2];\n"
        f"{indent}pushing_mpc_step(&controller, &path, NULL, i * period, pose, box, command);",
        "START": reach,
    }
    return _write(folder, program, memory, parts, robot, config.period)


def _write(
    folder: str | Path,
    program: Program,
    memory: Any,
    parts: dict[str, str],
    robot: RobotModel,
    period: float,
) -> list[Path]:
    struct, size = MemoryStruct(memory), robot.circumscribed_radius
    name = parts["NAME"]
    parts = {
        **parts,
        "HEADING": f"/* {parts['TITLE']}; written by pushplan {__version__}. */",
        "VERSION": __version__,
        "GUARD": name.upper(),
        "MEMORY": type(memory).__name__,
        "PROGRAM": program.text(),
        "VIEW": struct.view(),
        "SET": "\n".join(struct.set()),
        "FIELDS": "\n".join(struct.declared()),
        "PERIOD": repr(period),
        "OFFSET": repr(round(0.02 * size, 6)),
        "SPACING": repr(round(0.2 * size, 6)),
        "SPEED": repr(0.8 * robot.max_speed),
    }
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    templates = ("template.h", "template.c", "example.c", "readme.md")
    names = (f"{name}.h", f"{name}.c", "main.c", "README.md")
    files = []
    for template, target in zip(templates, names, strict=True):
        text = (_HERE / template).read_text(encoding="utf-8")
        for key, value in parts.items():
            text = text.replace(f"@{key}@", value)
        path = folder / target
        path.write_bytes(text.encode())
        files.append(path)
    return files
