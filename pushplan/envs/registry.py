"""Tables of ``"module:Class"`` texts: an entry costs nothing until somebody asks for it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from pushplan.errors import InvalidInputError, ScenarioError
from pushplan.imports.named_objects import look_up_or_load
from pushplan.imports.on_demand import Registered, look_up

if TYPE_CHECKING:
    from pushplan.envs.tasks.base import Task

TASKS = Registered(
    "pushplan.tasks",
    {
        "maze": "pushplan.envs.tasks.maze:MazeTask",
        "namo": "pushplan.envs.tasks.namo:NamoTask",
        "box_delivery": "pushplan.envs.tasks.box_delivery:BoxDeliveryTask",
        "area_clearing": "pushplan.envs.tasks.area_clearing:AreaClearingTask",
        "ship_ice": "pushplan.envs.tasks.ship_ice:ShipIceTask",
        "room": "pushplan.envs.tasks.room:RoomTask",
        "rearrange": "pushplan.envs.tasks.rearrange:RearrangeTask",
        "office": "pushplan.envs.tasks.office:OfficeTask",
    },
)
SIMULATORS = Registered(
    "pushplan.simulators",
    {
        "mujoco": "pushplan.envs.simulators.mujoco_simulator:MujocoSimulator",
        "pymunk": "pushplan.envs.simulators.pymunk_simulator:PymunkSimulator",
    },
)
ACTIONS: Mapping[str, str] = {
    "turn_rate": "pushplan.envs.action_modes:TurnRateAction",
    "heading": "pushplan.envs.drive_actions:HeadingAction",
    "waypoint": "pushplan.envs.drive_actions:WaypointAction",
    "velocity": "pushplan.envs.action_modes:VelocityAction",
    "omnidirectional": "pushplan.envs.action_modes:OmnidirectionalAction",
    "wheels": "pushplan.envs.action_modes:WheelsAction",
}
GYM_IDS: Mapping[str, str] = {
    f"pushplan/{''.join(word.capitalize() for word in name.split('_'))}-v0": name for name in TASKS
}
"""Gymnasium id -> task."""


def task_class(task: str) -> type[Task]:
    """The class of a task: by name, or one of a user's as ``"file.py:Class"``, ``"module:Class"``.

    Raises:
        UnknownNameError: if there is no such task.
        InvalidInputError: if what the text names cannot be loaded or is no `Task`.
    """
    from pushplan.envs.tasks.base import Task

    found = look_up_or_load("task", TASKS, task)
    if not (isinstance(found, type) and issubclass(found, Task)):
        raise InvalidInputError(f"task {task!r} must be a class below pushplan.envs.tasks.Task")
    return found


def goal_kind(task: str, variations: Mapping[str, object] | None = None) -> str | None:
    """Who has the goal in a task, ``"robot"`` or ``"objects"``; None for an unknown task."""
    if task not in TASKS and ":" not in task:
        return None
    return task_class(task).goal_kind_of(variations or {})


def default_preset(task: str, simulator: str) -> str:
    """The first preset of a task that suits a simulator.

    Raises:
        UnknownNameError: if there is no such task or simulator.
        ScenarioError: if the task has no third dimension, which the simulator needs.
    """
    kind = task_class(task)
    engine = look_up("simulator", SIMULATORS, simulator)
    presets = kind.solid_presets if engine.needs_solids else kind.presets
    if not presets:
        raise ScenarioError(
            f"{kind.name}: simulator {simulator!r} needs a preset with a third dimension, of which "
            "the task has none (valid: pymunk)"
        )
    return presets[0]
