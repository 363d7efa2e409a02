"""Materials of the tasks with boxes, and the third dimension of the testbed, by robot."""

from __future__ import annotations

from collections.abc import Mapping

from pushplan.envs.simulators.base import Materials, Solids

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

BENCHMARK_MATERIALS = Materials(
    robot_object=0.0, object_object=1.0, object_static=0.5, rolling_time=2.0
)
"""Those of the 2D benchmark: boxes 1.0, walls 0.5, and no grip at the bumper."""
TESTBED_MATERIALS = Materials(
    robot_object=0.4,
    object_object=0.4,
    object_static=0.4,
    rolling_time=0.5,
    solids=SOLIDS["turtlebot3"],
)
