#!/usr/bin/env python3
"""A ROS 2 node that plans paths and drives them, in place of Nav2's planner and controller servers.

    python examples/ros2/node.py --ros-args -p robot:=examples/room.yaml -p planner:=push-aware

docs/ros2.md names topics, actions and parameters.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable
from functools import partial
from typing import Any

import rclpy
from builtin_interfaces.msg import Duration as DurationMessage
from geometry_msgs.msg import Point, Pose, TwistStamped
from geometry_msgs.msg import Twist as TwistMessage
from nav2_msgs.action import ComputePathToPose, FollowPath
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from navigator import PATH, NavigationError, Navigator
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rclpy.time import Time
from scene import Scene
from visualization_msgs.msg import MarkerArray

from pushplan.ros import McapLog, Messages, RclpyTypes, pose_from
from pushplan.runtime import Motors
from pushplan.world import InvalidInputError, PushplanError, Stop, StopCheck, Twist
from pushplan.world.checks import FloatArray
from pushplan.world.stored.world_files import load_world

try:
    import tf2_ros
except ModuleNotFoundError:  # then all messages have to be in one frame
    tf2_ros = None


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


PARAMETERS = {
    "autostart": True,
    "robot": "examples/room.yaml",
    "frame": "map",
    "costmap": "",
    "costmap_price": 2.0,
    "transform_tolerance": 0.1,
    "planner": "push-aware",
    "controller": PATH,
    "period": 0.05,
    "budget": 1.0,
    "tolerance": 0.1,
    "heading_tolerance": 0.0,
    "margin": 0.0,
    "movement_time_allowance": 10.0,
    "failure_tolerance": 1.0,
    "max_age": 0.5,
    "stamped_cmd_vel": False,
    "log": "",
}
"""Parameters with their defaults; docs/ros2.md explains them."""


class PushplanNode(LifecycleNode):  # type: ignore[misc]
    """Serves ``compute_path_to_pose`` and ``follow_path`` while it is active."""

    def __init__(self) -> None:
        super().__init__("pushplan")
        self.declare_parameters("", list(PARAMETERS.items()))
        self._driving = threading.Lock()
        self._newest: Any = None
        self._active = False
        self._made: list[tuple[Callable[[Any], Any], Any]] = []
        self._tf: Any = None
        if tf2_ros is not None:
            self._tf = tf2_ros.Buffer()
            self._listener = tf2_ros.TransformListener(self._tf, self)

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Make everything; a parameter that is refused leaves the node unconfigured."""
        try:
            self._configure()
        except (PushplanError, NavigationError, OSError) as error:
            self._release()
            self.get_logger().error(str(error))
            return TransitionCallbackReturn.FAILURE
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Accept goals from now on."""
        self._motors = Motors(
            self._publish,
            self._scene.robot,
            period=self._value("period"),
            timeout=self._value("max_age"),
        )
        done = super().on_activate(state)
        self._active = True
        self.get_logger().info("ready")
        return done

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Accept no more goals, brake the robot and end the goal that it drives to."""
        self._stand()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Forget everything."""
        self._release()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Brake the robot and forget everything."""
        self.close()
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Brake the robot; the node may be configured again."""
        return self.on_shutdown(state)

    def _configure(self) -> None:
        value, frame = self._value, self._value("frame")
        robot = load_world(value("robot")).robot
        pose_of = None if self._tf is None else self._pose_of
        self._scene = Scene(robot, frame=frame, pose_of=pose_of, margin=value("margin"))
        self._messages = Messages(RclpyTypes(), frame_id=frame)
        log = McapLog(value("log"), frame_id=frame) if value("log") else None
        if log is not None:
            self._made.append((McapLog.close, log))
        self.navigator = Navigator(
            self._scene,
            self._messages,
            period=value("period"),
            planner=value("planner"),
            controller=value("controller"),
            budget=value("budget"),
            tolerance=value("tolerance"),
            heading_tolerance=value("heading_tolerance"),
            patience=(value("movement_time_allowance"), value("failure_tolerance")),
            max_age=value("max_age"),
            log=log,
        )
        self._made.append((Navigator.close, self.navigator))
        group = ReentrantCallbackGroup()
        in_order = MutuallyExclusiveCallbackGroup()
        kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        velocity = TwistStamped if value("stamped_cmd_vel") else TwistMessage
        self._cmd_vel = self.create_lifecycle_publisher(velocity, "cmd_vel", 1)
        self._plan = self.create_lifecycle_publisher(Path, "plan", kept)
        self._made += [(self.destroy_lifecycle_publisher, p) for p in (self._cmd_vel, self._plan)]
        # each takes what any publisher offers: best effort, and maps of before or of later on
        sensor = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        costmap = value("costmap")
        grid, take_grid = costmap or "map", self._scene.take_map
        if costmap:
            take_grid = partial(self._scene.take_costmap, most=value("costmap_price"))
        for kind, topic, take, qos, calls in (
            (OccupancyGrid, grid, take_grid, kept, group),
            (OccupancyGrid, grid, take_grid, sensor, group),
            (Odometry, "odom", self._take_odometry, sensor, in_order),
            (MarkerArray, "objects", self._take_objects, sensor, group),
        ):
            heard = self.create_subscription(
                kind, topic, self._checked(topic, take), qos, callback_group=calls
            )
            self._made.append((self.destroy_subscription, heard))
        for served, name, execute, accepted in (
            (ComputePathToPose, "compute_path_to_pose", self._compute_path, _execute),
            (FollowPath, "follow_path", self._follow_path, self._execute_newest),
        ):
            server = ActionServer(
                self,
                served,
                name,
                execute,
                callback_group=group,
                goal_callback=self._is_accepted,
                handle_accepted_callback=accepted,
                cancel_callback=lambda _: CancelResponse.ACCEPT,
            )
            self._made.append((ActionServer.destroy, server))

    def _stand(self) -> None:
        """Brake the robot; its last velocity is zero."""
        if self._active:
            self._active = False
            self.navigator.cancel()  # so that its loop ends
            self._motors.close()
            with self._driving:
                pass  # until the loop has ended

    def _release(self) -> None:
        while self._made:
            end, made = self._made.pop()
            end(made)

    def close(self) -> None:
        """Brake the robot and end planning and logging, in whatever state."""
        self._stand()
        self._release()

    def _is_accepted(self, _: Any) -> GoalResponse:
        return GoalResponse.ACCEPT if self._active else GoalResponse.REJECT

    def _value(self, name: str) -> Any:
        return self.get_parameter(name).value

    def _now(self) -> float:
        return 1e-9 * float(self.get_clock().now().nanoseconds)

    def _pose_of(self, header: Any) -> FloatArray:
        """The pose of a header's frame in that of the world, by tf2."""
        frame, target = header.frame_id, self._scene.frame
        time = Time.from_msg(header.stamp)  # 0 is the newest
        wait = Duration(seconds=self._value("transform_tolerance"))
        try:
            found = self._tf.lookup_transform(target, frame, time, wait)
        except tf2_ros.TransformException as error:
            raise InvalidInputError(
                f"no transform from {frame!r} to {target!r}: {error}"
            ) from error
        move = found.transform
        place = Point(x=move.translation.x, y=move.translation.y, z=move.translation.z)
        return pose_from(Pose(position=place, orientation=move.rotation))

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
            if not self._active:
                return self._ended(handle, result, "UNKNOWN", "the node is not active")
            try:
                self.navigator.follow(goal.path, goal.controller_id)
            except NavigationError as error:
                self.navigator.cancel()  # nobody asks for what was driven before
                self._drive(handle)
                return self._ended(handle, result, error.code, str(error))
            return self._ended(handle, result, *self._drive(handle))

    def _drive(self, handle: Any) -> tuple[str, str]:
        """The control loop, until the robot stands or another path has come in."""
        clock, period = self.get_clock(), Duration(seconds=self._value("period"))
        due, outcome = clock.now(), ("UNKNOWN", "another path has come in")
        try:
            while self.navigator.is_driving and handle is self._newest:
                if handle.is_cancel_requested:
                    self.navigator.cancel()
                step = self.navigator.step(self._now())
                self._motors.drive(step.twist)
                handle.publish_feedback(
                    FollowPath.Feedback(distance_to_goal=step.distance, speed=step.twist.linear)
                )
                outcome = (step.outcome, step.reason) if step.outcome else outcome
                now = clock.now()  # which may have stepped back
                due = min(max(due + period, now), now + period)
                clock.sleep_until(due)
        except Exception:
            self._motors.brake()
            raise
        return outcome

    def _publish(self, twist: Twist) -> None:
        if self._value("stamped_cmd_vel"):
            message = self._messages.twist_stamped(twist, self._now())
        else:
            message = self._messages.twist(twist)
        self._cmd_vel.publish(message)

    def _ended(self, handle: Any, result: Any, outcome: str, reason: str) -> Any:
        """The result of a goal, after its state is set."""
        if outcome == "SUCCEEDED":
            handle.succeed()
        elif handle.is_cancel_requested and outcome == "CANCELED":
            handle.canceled()
        else:  # canceled by nobody: the node is deactivated
            self.get_logger().warning(f"{outcome}: {reason}")
            result.error_code = getattr(result, outcome, result.UNKNOWN)
            if hasattr(result, "error_msg"):  # not in every release of Nav2
                result.error_msg = reason
            handle.abort()
        return result


def _execute(handle: Any) -> None:
    handle.execute()


def main() -> None:
    """Serve until interrupted or terminated; the robot brakes before anything else ends."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)  # after its own nothing is sent
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda number, _: sys.exit(128 + number))
    node = PushplanNode()
    executor = MultiThreadedExecutor(8)
    executor.add_node(node)
    done = TransitionCallbackReturn.SUCCESS
    try:
        if node.get_parameter("autostart").value:  # else a lifecycle manager does it
            if node.trigger_configure() != done:
                sys.exit("pushplan cannot be configured")
            node.trigger_activate()
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
