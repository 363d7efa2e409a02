"""The third dimension of the testbed, by robot."""

from __future__ import annotations

from collections.abc import Mapping

from pushplan.envs.simulators.base import Solids

SOLIDS: Mapping[str, Solids] = {
    "turtlebot3": Solids(
        object_height=0.08,
        robot_height=0.12,
        wall_height=0.2,
        bumper_height=0.06,
        wheel_radius=0.033,
    ),
    # wheel radius as in github.com/jackal/jackal, jackal_description/urdf/jackal.urdf.xacro
    "jackal": Solids(
        object_height=0.08,
        robot_height=0.25,
        wall_height=0.2,
        bumper_height=0.1,
        wheel_radius=0.098,
    ),
}
"""Heights [m]: boxes are 8 cm cubes, walls 0.2 m; the Burger's lidar tower is left out."""
