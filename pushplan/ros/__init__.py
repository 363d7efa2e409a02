"""ROS 2: its messages, with or without ROS installed, and logs as MCAP."""

from pushplan.ros.mcap_episodes import load_episode, save_episode
from pushplan.ros.mcap_writer import McapLog
from pushplan.ros.reading import (
    frame_of,
    path_from,
    plan_from,
    polygon_from,
    pose_from,
    price_map_from,
    static_map_from,
    time_from,
    twist_from,
)
from pushplan.ros.ros_messages import Messages, MessageTypes, RclpyTypes, RosbagsTypes

__all__ = [
    "McapLog",
    "MessageTypes",
    "Messages",
    "RclpyTypes",
    "RosbagsTypes",
    "frame_of",
    "load_episode",
    "path_from",
    "plan_from",
    "polygon_from",
    "pose_from",
    "price_map_from",
    "save_episode",
    "static_map_from",
    "time_from",
    "twist_from",
]
