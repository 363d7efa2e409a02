"""Stands for `tf2_ros`, of which there is no wheel: ``odom`` is at (0.5, -0.25) in ``map``."""

from geometry_msgs.msg import TransformStamped
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time import Time


class TransformException(Exception):
    """No transform."""


class Buffer:
    def lookup_transform(self, target_frame, source_frame, time, timeout):
        assert isinstance(time, Time) and isinstance(timeout, Duration)
        if (target_frame, source_frame) != ("map", "odom"):
            raise TransformException(f'"{source_frame}" does not exist')
        found = TransformStamped()
        found.transform.translation.x, found.transform.translation.y = 0.5, -0.25
        return found


class TransformListener:
    def __init__(self, buffer, node, *, spin_thread=False):
        assert isinstance(buffer, Buffer) and isinstance(node, Node)
