"""Tables of ``"module:Class"`` texts: an entry costs nothing until somebody asks for it."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

from pushplan.world import UnknownNameError

TASKS: Mapping[str, str] = {
    "maze": "pushplan.envs.tasks.maze:MazeTask",
}
SIMULATORS: Mapping[str, str] = {
    "pymunk": "pushplan.envs.simulators.pymunk_simulator:PymunkSimulator",
}
ACTIONS: Mapping[str, str] = {
    "turn_rate": "pushplan.envs.actions:TurnRateAction",
    "heading": "pushplan.envs.drive_actions:HeadingAction",
    "waypoint": "pushplan.envs.drive_actions:WaypointAction",
    "velocity": "pushplan.envs.actions:VelocityAction",
    "wheels": "pushplan.envs.actions:WheelsAction",
}
GYM_IDS: Mapping[str, str] = {
    "pushplan/Maze-v0": "maze",
}


def look_up(kind: str, table: Mapping[str, str], name: object) -> Any:
    """Import and return what ``name`` stands for in a table.

    Raises:
        UnknownNameError: if it is not in the table.
    """
    if not isinstance(name, str) or name not in table:
        raise UnknownNameError(kind, name, table)
    module, _, attribute = table[name].partition(":")
    return getattr(import_module(module), attribute)
