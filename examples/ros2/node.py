"""A ROS 2 node that plans paths and drives them, in place of Nav2's planner and controller servers.

    python examples/ros2/node.py --ros-args -p robot:=examples/room.yaml -p planner:=push-aware

docs/ros2.md names topics, actions and parameters.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import rclpy
from builtin_interfaces.msg import Duration as DurationMessage
from geometry_msgs.msg import Twist as TwistMessage
from geometry_msgs.msg import TwistStamped
from nav2_msgs.action import ComputePathToPose, FollowPath
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from navigator import PATH, NavigationError, Navigator
from rclpy.action import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from scene import Scene
from visualization_msgs.msg import MarkerArray

from pushplan.ros import McapLog, Messages, RclpyTypes
from pushplan.runtime import Motors
from pushplan.world import InvalidInputError, Stop, StopCheck, Twist
from pushplan.world.stored.world_files import load_world


class CancelRequest(Stop):
    """Ends a planning call when the client of an action cancels its goal."""

    def __init__(self, handle: Any) -> None:
        self._handle = handle

    @property
    def cancelled(self) -> bool:
        """Whether it has."""
        return bool(self._handle.is_cancel_requested)

    def start(self) -> StopCheck:
        """See `pushplan.world.Stop`."""
        return lambda iterations, cost: self.cancelled


class PushplanNode(Node):  # type: ignore[misc]
    """Serves ``compute_path_to_pose`` and ``follow_path``."""

    def __init__(self) -> None:
        super().__init__("pushplan")
        frame, log = self._value("frame", "map"), self._value("log", "")
        robot = load_world(self._value("robot", "examples/room.yaml")).robot
        self._scene = Scene(robot, frame=frame, margin=self._value("margin", 0.0))
        self._messages = Messages(RclpyTypes(), frame_id=frame)
        self._log = McapLog(log, frame_id=frame) if log else None
        self._period, max_age = self._value("period", 0.05), self._value("max_age", 0.5)
        self.navigator = Navigator(
            self._scene,
            self._messages,
            period=self._period,
            planner=self._value("planner", "push-aware"),
            controller=self._value("controller", PATH),
            budget=self._value("budget", 1.0),
            tolerance=self._value("tolerance", 0.1),
            heading_tolerance=self._value("heading_tolerance", 0.0),
            patience=(
                self._value("movement_time_allowance", 10.0),
                self._value("failure_tolerance", 1.0),
            ),
            max_age=max_age,
            log=self._log,
        )
        self._driving = threading.Lock()
        self._newest: Any = None
        group = ReentrantCallbackGroup()
        kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._stamped = self._value("stamped_cmd_vel", False)
        velocity = TwistStamped if self._stamped else TwistMessage
        self._cmd_vel = self.create_publisher(velocity, "cmd_vel", 1)
        self.motors = Motors(self._publish, robot, period=self._period, timeout=max_age)
        self._plan = self.create_publisher(Path, "plan", kept)
        # each takes what any publisher offers: best effort, and maps of before or of later on
        sensor = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        for kind, topic, take, qos in (
            (OccupancyGrid, "map", self._scene.take_map, kept),
            (OccupancyGrid, "map", self._scene.take_map, sensor),
            (Odometry, "odom", self._take_odometry, sensor),
            (MarkerArray, "objects", self._take_objects, sensor),
        ):
            self.create_subscription(
                kind, topic, self._checked(topic, take), qos, callback_group=group
            )
        self._servers = [
            ActionServer(
                self,
                kind,
                name,
                execute,
                callback_group=group,
                handle_accepted_callback=accepted,
                cancel_callback=lambda _: CancelResponse.ACCEPT,
            )
            for kind, name, execute, accepted in (
                (ComputePathToPose, "compute_path_to_pose", self._compute_path, _execute),
                (FollowPath, "follow_path", self._follow_path, self._execute_newest),
            )
        ]
        self.get_logger().info("ready")

    def close(self) -> None:
        """End driving, planning and logging."""
        self.navigator.cancel()  # so that its loop ends
        self.navigator.close()
        if self._log is not None:
            self._log.close()

    def _value(self, name: str, default: Any) -> Any:
        return self.declare_parameter(name, default).value

    def _now(self) -> float:
        return 1e-9 * float(self.get_clock().now().nanoseconds)

    def _checked(self, topic: str, take: Callable[[Any], None]) -> Callable[[Any], None]:
        """A callback that says what is wrong with a message, at most once a second."""

        def checked(message: Any) -> None:
            try:
                take(message)
            except InvalidInputError as error:
                self.get_logger().warning(f"{topic}: {error}", throttle_duration_sec=1.0)

        return checked

    def _take_odometry(self, message: Any) -> None:
        self._scene.take_odometry(message)
        self.navigator.see()

    def _take_objects(self, message: Any) -> None:
        self._scene.take_objects(message, self._now())

    def _compute_path(self, handle: Any) -> Any:
        goal, result = handle.request, ComputePathToPose.Result()
        try:
            result.path, seconds = self.navigator.compute_path(
                goal.goal,
                goal.start if goal.use_start else None,
                goal.planner_id,
                CancelRequest(handle),
            )
        except NavigationError as error:
            return self._ended(handle, result, error.code, str(error))
        second, rest = divmod(round(1e9 * seconds), 10**9)
        result.planning_time = DurationMessage(sec=second, nanosec=rest)
        self._plan.publish(result.path)
        return self._ended(handle, result, "SUCCEEDED", "")

    def _execute_newest(self, handle: Any) -> None:
        self._newest = handle
        handle.execute()

    def _follow_path(self, handle: Any) -> Any:
        goal, result = handle.request, FollowPath.Result()
        with self._driving:  # the goal before this one ends first
            try:
                self.navigator.follow(goal.path, goal.controller_id)
            except NavigationError as error:
                self.navigator.cancel()  # nobody asks for what was driven before
                self._drive(handle)
                return self._ended(handle, result, error.code, str(error))
            return self._ended(handle, result, *self._drive(handle))

    def _drive(self, handle: Any) -> tuple[str, str]:
        """The control loop, until the robot stands or another path has come in."""
        clock, period = self.get_clock(), Duration(seconds=self._period)
        due, outcome = clock.now(), ("UNKNOWN", "another path has come in")
        try:
            while self.navigator.is_driving and handle is self._newest:
                if handle.is_cancel_requested:
                    self.navigator.cancel()
                step = self.navigator.step(self._now())
                self.motors.drive(step.twist)
                handle.publish_feedback(
                    FollowPath.Feedback(distance_to_goal=step.distance, speed=step.twist.linear)
                )
                outcome = (step.outcome, step.reason) if step.outcome else outcome
                now = clock.now()  # which may have stepped back
                due = min(max(due + period, now), now + period)
                clock.sleep_until(due)
        except Exception:
            self.motors.brake()
            raise
        return outcome

    def _publish(self, twist: Twist) -> None:
        messages = self._messages
        stamped = self._stamped
        self._cmd_vel.publish(
            messages.twist_stamped(twist, self._now()) if stamped else messages.twist(twist)
        )

    def _ended(self, handle: Any, result: Any, outcome: str, reason: str) -> Any:
        """The result of a goal, after its state is set."""
        if outcome == "SUCCEEDED":
            handle.succeed()
        elif outcome == "CANCELED":
            handle.canceled()
        else:
            self.get_logger().warning(f"{outcome}: {reason}")
            result.error_code = getattr(result, outcome)
            if hasattr(result, "error_msg"):  # not in every release of Nav2
                result.error_msg = reason
            handle.abort()
        return result


def _execute(handle: Any) -> None:
    handle.execute()


def main() -> None:
    """Serve until interrupted or terminated; the robot brakes before anything else ends."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)  # after its own nothing is sent
    node = PushplanNode()
    executor = MultiThreadedExecutor(8)
    executor.add_node(node)
    try:
        with node.motors:
            while rclpy.ok():
                executor.spin_once(timeout_sec=0.1)  # signals are heard in between
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.close()
        executor.shutdown()
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
