"""Tables of ``"module:Class"`` texts: an entry costs nothing until somebody asks for it."""

from __future__ import annotations

from collections.abc import Mapping

from pushplan.imports.on_demand import Registered, look_up

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


def goal_kind(task: str, variations: Mapping[str, object] | None = None) -> str | None:
    """Who has the goal in a task, ``"robot"`` or ``"objects"``; None for an unknown task."""
    if task not in TASKS:
        return None
    kind: str = look_up("task", TASKS, task).goal_kind_of(variations or {})
    return kind


def default_preset(task: str, simulator: str) -> str:
    """The first preset of a task that suits a simulator.

    Raises:
        UnknownNameError: if there is no such task or simulator.
    """
    kind = look_up("task", TASKS, task)
    engine = look_up("simulator", SIMULATORS, simulator)
    presets: tuple[str, ...] = kind.solid_presets if engine.needs_solids else kind.presets
    return presets[0]
