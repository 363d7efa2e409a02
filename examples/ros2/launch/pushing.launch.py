"""Start pushplan's node, Nav2's behaviour trees, and the lifecycle manager of both.

    ros2 launch pushplan_nav2 pushing.launch.py robot:=/path/to/robot.yaml

Map, localisation and costmap are those of Nav2's own launch files.
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import LifecycleNode, Node

SHARE = Path(__file__).resolve().parents[1]


def generate_launch_description() -> LaunchDescription:
    """The nodes that `ros2 launch` starts."""
    params = LaunchConfiguration("params_file")
    clock = {"use_sim_time": LaunchConfiguration("use_sim_time")}
    tree = {
        "default_nav_to_pose_bt_xml": str(SHARE / "behavior_trees" / "navigate_pushing.xml"),
    }
    return LaunchDescription(
        [
            DeclareLaunchArgument("robot", description="world file that defines the robot"),
            DeclareLaunchArgument(
                "params_file", default_value=str(SHARE / "config" / "pushplan.yaml")
            ),
            DeclareLaunchArgument("use_sim_time", default_value="false"),
            LifecycleNode(
                package="pushplan_nav2",
                executable="node.py",
                name="pushplan",
                namespace="",
                output="screen",
                parameters=[params, {"robot": LaunchConfiguration("robot")}, clock],
            ),
            Node(
                package="nav2_bt_navigator",
                executable="bt_navigator",
                name="bt_navigator",
                output="screen",
                parameters=[params, tree, clock],
            ),
            Node(
                package="nav2_lifecycle_manager",
                executable="lifecycle_manager",
                name="lifecycle_manager_pushing",
                output="screen",
                parameters=[params, clock],
            ),
        ]
    )
