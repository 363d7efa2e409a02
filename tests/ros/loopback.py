"""A robot and a client of the node, on ROS 2; `test_loopback` runs it beside the node.

Prints what happened as JSON: outcome, error code and numbers of each goal.
"""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import threading
import time

import numpy as np
import rclpy
from action_msgs.msg import GoalStatus
from geometry_msgs.msg import Twist
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from nav2_msgs.action import ComputePathToPose, FollowPath
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from rclpy.action import ActionClient
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from visualization_msgs.msg import Marker, MarkerArray

from pushplan.ros import Messages, RclpyTypes, path_from, twist_from

MESSAGES = Messages(RclpyTypes())
RATE = 50.0


class Robot(Node):
    """A differential drive in a room with a wall and a box in its only door."""

    def __init__(self):
        super().__init__("robot")
        kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.pose, self.twist, self.told = np.array([1.0, 0.75, 0.0]), (0.0, 0.0), 0
        self.slowest, self.drives, self.paths = math.inf, True, 0
        self.speeds = []
        self.create_subscription(Twist, "cmd_vel", self.take, 1)
        self.create_subscription(Path, "plan", self.count, kept)
        self.odometry = self.create_publisher(Odometry, "odom", 1)
        self.objects = self.create_publisher(MarkerArray, "objects", 1)
        self.map = self.create_publisher(OccupancyGrid, "global_costmap/costmap", kept)
        grid = np.zeros((60, 80), dtype=int)
        grid[[0, -1]] = grid[:38, 39:41] = 100
        grid[:, [0, -1]] = 100
        self.map.publish(MESSAGES.occupancy(grid, 0.05))
        self.create_timer(1.0 / RATE, self.move)
        self.create_timer(0.1, self.show)

    def now(self):
        return 1e-9 * self.get_clock().now().nanoseconds

    def take(self, message):
        twist = twist_from(message)
        self.slowest = min(self.slowest, twist.linear)
        self.twist, self.told = (twist.linear, twist.angular), self.told + 1
        self.speeds.append(twist.linear)

    def count(self, message):
        self.paths += 1

    def move(self):
        speed, turn = self.twist if self.drives else (0.0, 0.0)
        self.pose[2] += turn / RATE
        heading = np.array([math.cos(self.pose[2]), math.sin(self.pose[2])])
        self.pose[:2] += speed / RATE * heading
        header = MESSAGES.header(self.now(), "odom")
        message = Odometry(header=header, child_frame_id="base_link")
        message.pose.pose = MESSAGES.pose(self.pose - [0.5, -0.25, 0.0])
        message.twist.twist.linear.x, message.twist.twist.angular.z = speed, turn
        self.odometry.publish(message)

    def show(self):
        box = Marker(header=MESSAGES.header(self.now()), id=4, type=Marker.CUBE)
        box.pose = MESSAGES.pose((3.0, 2.6, 0.2))
        box.scale.x = box.scale.y = 0.1
        self.objects.publish(MarkerArray(markers=[box]))


def main():
    rclpy.init()
    robot = Robot()
    plan = ActionClient(robot, ComputePathToPose, "compute_path_to_pose")
    drive = ActionClient(robot, FollowPath, "follow_path")
    executor = MultiThreadedExecutor(4)
    executor.add_node(robot)
    change = robot.create_client(ChangeState, "pushplan/change_state")
    state = robot.create_client(GetState, "pushplan/get_state")
    spinning = threading.Thread(target=executor.spin, daemon=True)
    spinning.start()
    assert plan.wait_for_server(600.0) and drive.wait_for_server(10.0)
    report = {}

    def told(result, **more):
        status = {
            GoalStatus.STATUS_SUCCEEDED: "succeeded",
            GoalStatus.STATUS_CANCELED: "canceled",
            GoalStatus.STATUS_ABORTED: "aborted",
        }[result.status]
        return {"status": status, "code": result.result.error_code, **more}

    def computed(name, x, y, *, frame="map", **fields):
        goal = ComputePathToPose.Goal(goal=MESSAGES.pose_stamped((x, y, 0.0), 0.0), **fields)
        goal.goal.header.frame_id = frame
        began = time.monotonic()
        result = plan.send_goal(goal)
        report[name] = told(result, seconds=time.monotonic() - began)
        return result.result.path

    def sent(path, name="", feedback=None):
        goal = FollowPath.Goal(path=path, controller_id=name)
        handle = wait(drive.send_goal_async(goal, feedback_callback=feedback))
        assert handle.accepted
        return handle, handle.get_result_async()

    def wait(future, seconds=90.0):
        end = time.monotonic() + seconds
        while not future.done():
            assert time.monotonic() < end, "nothing came back"
            time.sleep(0.005)
        return future.result()

    def last_twist():
        """The last command, which may come in after the result of its goal."""
        end = time.monotonic() + 5.0
        while robot.twist != (0.0, 0.0) and time.monotonic() < end:
            time.sleep(0.005)
        return robot.twist

    def under_way(left, seconds=60.0):
        """Wait until the robot drives, and is some way from where it stood."""
        end, begun = time.monotonic() + seconds, robot.pose[:2].copy()
        while robot.twist[0] < 0.2 or math.dist(robot.pose[:2], begun) < left:
            assert time.monotonic() < end, "the robot does not drive"
            time.sleep(0.005)
        return robot.twist[0]

    # through the door, on the path as it was planned, until another path displaces it
    end = time.monotonic() + 60.0
    while not (path := computed("first", 3.0, 2.2)).poses:  # map and odometry are to come in
        assert time.monotonic() < end, report["first"]
        time.sleep(0.2)
    _, first = sent(path)
    before = under_way(0.5)
    path = computed("second", 3.0, 0.75)
    robot.slowest, heard = math.inf, []
    _, second = sent(path, feedback=lambda message: heard.append(message.feedback))
    report["displaced"] = told(wait(first), before=before)
    time.sleep(1.0)
    report["driven"] = {"slowest": robot.slowest, "poses": len(path_from(path, "map")[1])}
    report["driven"] |= told(
        wait(second),
        off=math.dist(robot.pose[:2], (3.0, 0.75)),
        feedback=len(heard),
        distances=[heard[0].distance_to_goal, heard[-1].distance_to_goal],
        fastest=max(one.speed for one in heard),
        last=last_twist(),
    )
    # back, on plans of the controller's own; canceled on the way
    handle, future = sent(computed("back", 1.0, 0.75), "straight")
    before = under_way(0.2)
    assert wait(handle.cancel_goal_async()).goals_canceling
    report["canceled"] = told(wait(future), before=before, last=last_twist())
    # errors
    computed("outside", 9.0, 0.0)
    computed("occupied", 2.0, 0.75)
    computed("unknown planner", 1.0, 0.75, planner_id="NavFn")
    computed("planner of Nav2", 3.0, 2.2, planner_id="GridBased")
    _, future = sent(Path(header=MESSAGES.header(0.0)))
    report["empty path"] = told(wait(future))
    robot.drives = False
    _, future = sent(computed("stuck plan", 1.0, 0.75))
    report["stuck"] = told(wait(future), last=last_twist())
    report["robot"] = {"commands": robot.told, "plans": robot.paths}
    # frames
    computed("goal in odom", 2.5, 2.45, frame="odom")
    computed("goal in camera", 3.0, 2.2, frame="camera")

    # what a lifecycle manager does, while the robot drives and while it stands
    def changed(transition):
        request = ChangeState.Request(transition=Transition(id=transition))
        assert wait(change.call_async(request)).success
        return wait(state.call_async(GetState.Request())).current_state.label

    robot.drives = True
    _, future = sent(computed("interrupted plan", 3.0, 2.2))
    before = under_way(0.3)
    states = [changed(Transition.TRANSITION_DEACTIVATE)]
    report["interrupted"] = told(wait(future), before=before, last=last_twist())
    told_before = robot.told
    refused = wait(drive.send_goal_async(FollowPath.Goal(path=path))).accepted
    refused |= wait(plan.send_goal_async(ComputePathToPose.Goal())).accepted
    time.sleep(0.5)
    report["inactive"] = {"accepted": refused, "commands": robot.told - told_before}
    for transition in (
        Transition.TRANSITION_ACTIVATE,
        Transition.TRANSITION_DEACTIVATE,
        Transition.TRANSITION_CLEANUP,
        Transition.TRANSITION_CONFIGURE,
        Transition.TRANSITION_ACTIVATE,
    ):
        states.append(changed(transition))
    report["states"] = states
    end = time.monotonic() + 60.0
    assert plan.wait_for_server(10.0) and drive.wait_for_server(10.0)
    while not (path := computed("again", 1.0, 0.75)).poses:  # the map is to come in
        assert time.monotonic() < end, report["again"]
        time.sleep(0.2)
    _, future = sent(path)
    report["driven again"] = told(wait(future), off=math.dist(robot.pose[:2], (1.0, 0.75)))
    # the node is terminated while the robot drives
    robot.drives = True
    sent(computed("last", 3.0, 2.2))
    under_way(0.3)
    robot.speeds.clear()
    os.kill(int(sys.argv[1]), signal.SIGTERM)
    end = time.monotonic() + 20.0
    while robot.twist != (0.0, 0.0) and time.monotonic() < end:
        time.sleep(0.005)
    time.sleep(1.0)
    report["terminated"] = {"speeds": robot.speeds}
    print(json.dumps(report), flush=True)
    executor.shutdown()
    spinning.join()
    robot.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
