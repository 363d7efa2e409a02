"""A robot's loop: perception in, velocities out, and what to do about each status.

``python examples/control_loop.py`` drives through the blocked door in real time, about 15 s. In the
fourth second the camera is blind for a second. `Robot` stands in for yours: replace `sense` and
`drive`, and the loop below stays as it is.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from pushplan.envs import PushEnv
from pushplan.runtime import CommandStatus, Motors, Runner
from pushplan.world import Deadline, OwnBudget, Twist

PERIOD = 0.05  # of commands [s]; perception comes with every second one
DEADLINE = 2.0  # of a planning call [s]; it runs in another thread, commands go on
NOISE = [0.001, 0.001, 0.002]  # standard deviations of what is seen [m, m, rad]
PATIENCE = 3  # failures after which a person is called


class Robot:
    """A simulated one, and perception with noise."""

    def __init__(self, world_file):
        scene = {"world_file": str(world_file), "control_step": PERIOD}
        self.env = PushEnv(task="room", variations=scene, action="velocity")
        self.env.reset(seed=0)
        self.rng, self.ended = np.random.default_rng(0), ""

    @property
    def now(self):
        """The clock of the loop and of perception: when something was seen [s]."""
        return self.env.world.time

    def sense(self):
        """The `World` as it is seen now; None where nothing is seen."""
        if 3.0 < self.now < 4.0:
            return None
        world = self.env.world
        robot = self.rng.normal(world.robot_pose, NOISE)
        return world.moved(
            robot_pose=robot, movable_poses=self.rng.normal(world.movables.poses, NOISE)
        )

    def drive(self, twist):
        """Send a velocity to the motors."""
        if self.ended:
            return  # `Motors` brakes what is left of its speed
        *_, info = self.env.step(self.env.encode(twist))
        self.ended = info["reason"]  # "goal", "wall" or "time_limit" at the end


def loop(robot, runner, motors):
    """Drive until the goal is reached; why it ended."""
    runner.start(robot.sense())
    last, beat, due = None, 0, time.monotonic()
    while not robot.ended:
        seen = robot.sense() if beat % 2 == 0 else None
        if seen is not None:
            runner.update(seen)
        command = runner.command(robot.now)
        if command.status is not last:
            sys.stdout.write(f"{command.time:5.2f} s  {command.status:8s} {command.reason}\n")
            last = command.status
        match command.status:
            case CommandStatus.DONE:
                return "goal"
            case CommandStatus.FAILED if runner.failures >= PATIENCE:
                runner.cancel("planning has failed again and again")  # it brakes; call somebody
            case CommandStatus.CANCELLED if command.twist == Twist(0.0, 0.0):
                return "cancelled"  # it stands; start() would begin anew
            case _:  # driving, waiting for a plan, or stopped until the camera sees again:
                pass  # the command is right as it is, and the runner goes on by itself
        motors.drive(command.twist)
        beat, due = beat + 1, due + PERIOD
        time.sleep(max(0.0, due - time.monotonic()))
    return robot.ended


if __name__ == "__main__":
    world_file = sys.argv[1] if sys.argv[1:] else Path(__file__).with_name("blocked_door.yaml")
    stop = OwnBudget() | Deadline(DEADLINE)
    options = {"max_age": 0.3, "position_noise": NOISE[0], "heading_noise": NOISE[2]}
    policy = sys.argv[2] if sys.argv[2:] else "namo"
    robot = Robot(world_file)
    with (
        Runner(policy, period=PERIOD, plan_stop=stop, **options) as runner,
        Motors(robot.drive, robot.env.world.robot, period=PERIOD) as motors,  # zero is sent last
    ):
        outcome = loop(robot, runner, motors)
    sys.exit(0 if outcome == "goal" else outcome)
