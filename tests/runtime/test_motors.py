"""`Motors`: however a loop ends, zero is sent last, within the robot's accelerations."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from itertools import pairwise

import pytest
from conftest import make_robot
from test_runner import PERIOD, ROBOT, STILL, Straight, later, maze, until

from pushplan.runtime import CommandStatus, Motors, Runner
from pushplan.world import Deadline, Drive, InvalidInputError, Twist

ENDS = {
    "leaves the block": 0,
    "raises in the block": 1,
    "raises without a block": 1,
    "exits without a block": 3,
    "SIGTERM": 128 + signal.SIGTERM,
    "SIGHUP": 128 + signal.SIGHUP,
    "SIGINT": 130,
    "SIGTERM twice": 128 + signal.SIGTERM,
    "dies in a thread": 0,
}
SCRIPT = """
import os, signal, sys, threading, time
from pushplan.runtime import Motors
from pushplan.world import RobotModel, Twist

robot = RobotModel.from_outline(
    [[-1, -1], [1, -1], [1, 1], [-1, 1]], mass=1.0, drive="differential", max_speed=0.5,
    max_turn_rate=1.0, max_acceleration=1.5, max_turn_acceleration=5.0,
)

signal.signal(signal.SIGINT, signal.default_int_handler)  # jobs in the background ignore it

def child(end, log):
    def send(twist):
        os.write(log, f"{twist.linear!r} {twist.angular!r}\\n".encode())
        if end == "SIGTERM twice" and abs(twist.linear - 0.4) < 1e-6:
            os.kill(os.getpid(), signal.SIGTERM)

    motors = Motors(send, robot, period=0.02, timeout=0.1)
    motors.drive(Twist(0.49, -0.9))
    if "without a block" in end:
        if "exits" in end:
            sys.exit(3)
        raise ValueError("a fault in the loop")
    with motors:
        if end.startswith("SIG"):
            os.kill(os.getpid(), getattr(signal, end.split()[0]))
            time.sleep(10.0)
        if end == "raises in the block":
            raise ValueError("a fault in the loop")
        if end == "dies in a thread":
            thread = threading.Thread(target=lambda: 1 / 0)
            thread.start()
            while motors.twist != Twist(0.0, 0.0):
                time.sleep(0.01)
            os.write(log, b"braked\\n")

signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup has it ignored
folder, *ends = sys.argv[1:]
for end in ends:
    pid = os.fork()
    if pid == 0:
        sys.stderr = open(os.devnull, "w")
        child(end, os.open(os.path.join(folder, end), os.O_CREAT | os.O_WRONLY))
        sys.exit(0)
    _, status = os.waitpid(pid, 0)
    code = os.waitstatus_to_exitcode(status)
    print(130 if code == -signal.SIGINT else code, flush=True)
"""


@pytest.fixture(scope="module")
def ended(tmp_path_factory):
    """Exit status and what was sent, by how the program ended; one import for all of them."""
    folder = tmp_path_factory.mktemp("ends")
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(folder), *ENDS],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    codes = map(int, done.stdout.split())
    return {end: (code, (folder / end).read_text()) for end, code in zip(ENDS, codes, strict=True)}


@pytest.mark.slow
@pytest.mark.parametrize("end", ENDS)
def test_zero_is_sent_last_whatever_ends_the_program(end, ended):
    code, text = ended[end]
    assert code == ENDS[end]
    sent = [tuple(map(float, line.split())) for line in text.splitlines() if line != "braked"]
    assert sent[0] == (0.49, -0.9) and sent[-1] == (0.0, 0.0)
    limited = sent[:-1] if end == "SIGTERM twice" else sent  # which is interrupted
    for (v, w), (v_next, w_next) in pairwise(limited):
        assert abs(v - v_next) <= 1.5 * 0.02 + 1e-9 and abs(w - w_next) <= 5.0 * 0.02 + 1e-9
    if end == "dies in a thread":  # the thread braked, not the end of the block
        assert text.splitlines().index("braked") >= len(sent) - 2


class Sent:
    """Keeps what is sent, and fails where it is told to."""

    def __init__(self):
        self.twists, self.fails = [], False

    def __call__(self, twist):
        if self.fails:
            raise OSError("no route to the motors")
        self.twists.append(twist)

    def is_smooth(self, period):
        linear = [twist.linear for twist in self.twists]
        return all(abs(a - b) <= 0.6 * period + 1e-9 for a, b in pairwise(linear))


def test_a_loop_that_hangs_is_braked_for_and_goes_on_from_there():
    sent, period = Sent(), 0.01
    with Motors(sent, ROBOT, period=period, timeout=0.02) as motors:
        motors.drive(Twist(0.05, 0.0))
        until(lambda: motors.twist == STILL)
        motors._timeout = 60.0  # from here on the machine may be as slow as it likes
        for _ in range(20):
            motors.drive(Twist(0.05, 0.0))
        assert motors.twist == Twist(0.05, 0.0)
    assert sent.is_smooth(period) and sent.twists[-1] == STILL


def test_after_close_nothing_is_sent():
    sent = Sent()
    motors = Motors(sent, ROBOT, period=0.001)
    motors.drive(Twist(0.01, 0.0))
    motors.close()
    count = len(sent.twists)
    motors.drive(Twist(0.3, 0.0))
    motors.close()
    assert len(sent.twists) == count and sent.twists[-1] == STILL


def test_motors_that_fail_while_the_loop_hangs_are_tried_again():
    sent = Sent()
    motors = Motors(sent, ROBOT, period=0.001, timeout=0.002)
    motors.drive(Twist(0.3, 0.0))
    sent.fails = True
    until(lambda: motors.twist == STILL)
    with pytest.raises(OSError, match="no route"):
        motors.drive(Twist(0.3, 0.0))
    sent.fails = False
    motors.close()
    assert sent.twists[-1] == STILL


def test_a_robot_that_cannot_stand_is_told_zero_at_once():
    sent, ship = Sent(), make_robot(drive=Drive.CONSTANT_SPEED)
    with Motors(sent, ship, period=1.0, timeout=60.0) as motors:
        motors.drive(Twist(0.15, 0.1))
    assert sent.twists == [Twist(0.15, 0.1), STILL, STILL] or sent.twists[1:] == [STILL]


def test_signals_are_left_alone_where_somebody_else_handles_them():
    def mine(number, frame):
        pass

    before = signal.signal(signal.SIGTERM, mine)
    try:
        with Motors(Sent(), ROBOT, period=0.05):
            assert signal.getsignal(signal.SIGTERM) is mine
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        with Motors(Sent(), ROBOT, period=0.05):
            assert signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    finally:
        signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize("wrong", [{"period": 0.0}, {"timeout": -1.0}])
def test_times_without_sense_are_named(wrong):
    with pytest.raises(InvalidInputError, match=next(iter(wrong))):
        Motors(Sent(), ROBOT, **{"period": 0.05, **wrong})


@pytest.mark.parametrize("death", ["raises", "ends its thread", "hangs"])
def test_whatever_becomes_of_planning_the_robot_stands_in_the_end(death):
    planner, held, now, world = Straight(), threading.Event(), [0.0], maze()

    def does():
        if threading.current_thread() is threading.main_thread():
            return
        if death == "hangs":
            held.wait(20.0)
        else:
            raise ValueError("no") if death == "raises" else SystemExit

    sent = Sent()
    options = {"period": PERIOD, "plan_stop": Deadline(0.1), "clock": lambda: now[0]}
    with (
        Runner(planner, **options) as runner,
        Motors(sent, ROBOT, period=PERIOD, timeout=600.0) as motors,
    ):
        runner.start(world)
        until(lambda: not runner._executor.running_s)
        world = later(world, STILL)
        for n in range(80):
            if n == 30:
                planner.does = does
                runner.start(world)  # another goal: its plan is never made
            runner.update(world)
            command = runner.command(world.time)
            motors.drive(command.twist)
            world = later(world, command.twist)
            now[0] += PERIOD
            if death != "hangs" or n < 30:
                until(lambda: not runner._executor.running_s)
        held.set()
        assert command.status is CommandStatus.FAILED
        assert max(twist.linear for twist in sent.twists) > 0.2 and sent.twists[-1] == STILL
    assert sent.is_smooth(PERIOD)
