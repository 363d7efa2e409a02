import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pushplan.envs.actions import TurnRateAction, VelocityAction, WheelsAction
from pushplan.envs.registry import ACTIONS, look_up
from pushplan.envs.tasks.maze_presets import PRESETS
from pushplan.world import InvalidInputError, Twist, UnknownNameError, WheelSpeeds

unit = st.floats(-1.0, 1.0, width=32)


def mode(cls, preset="testbed"):
    return cls(PRESETS[preset].robot(cls.drive))


def command(m, values):
    motion = m.start(m.read(values), None)
    twist = motion(None)
    assert motion(None) is None  # these modes last one control step
    return twist


@pytest.mark.parametrize("name", ACTIONS)
@given(a=unit, b=unit)
def test_commands_keep_the_limits_and_come_back(name, a, b):
    m = mode(look_up("action", ACTIONS, name))
    values = np.array([a, b][: m.size], dtype=np.float32)
    twist = command(m, values)
    assert abs(twist.linear) <= m.robot.max_speed * (1 + 1e-9)
    assert abs(twist.angular) <= m.robot.max_turn_rate * (1 + 1e-9)
    back = command(m, m.encode(twist))
    assert back.linear == pytest.approx(twist.linear, abs=1e-6)
    assert back.angular == pytest.approx(twist.angular, abs=1e-5)


def test_turn_rate_scales_and_keeps_speed():
    assert command(mode(TurnRateAction, "benchmark"), [0.5]) == Twist(0.15, 0.0525)


def test_wheels_are_rim_speeds():
    m = mode(WheelsAction)
    assert m.encode(WheelSpeeds(0.1, 0.1)) == pytest.approx([0.5, 0.5])
    assert command(m, [0.5, 0.6]).angular == pytest.approx(0.02 / 0.16)
    spin = command(m, [-1.0, 1.0])
    assert spin.linear == 0.0 and spin.angular == m.robot.max_turn_rate


def test_too_fast_a_curve_keeps_its_radius():
    m = mode(WheelsAction)
    twist = command(m, m.encode(Twist(0.2, 0.5)))
    assert twist.linear < 0.2
    assert twist.linear / twist.angular == pytest.approx(0.4, rel=1e-5)


@pytest.mark.parametrize("name", ACTIONS)
def test_bad_actions_are_refused(name):
    m = mode(look_up("action", ACTIONS, name))
    for bad in (np.zeros(m.size + 1), 0.0, np.zeros((1, m.size)), ["a"] * m.size, None):
        with pytest.raises(InvalidInputError, match="shape"):
            m.read(bad)
    for bad in (np.nan, np.inf):
        with pytest.raises(InvalidInputError, match="finite, got"):
            m.read(np.full(m.size, bad))
    assert (np.abs(m.encode(np.full(m.size, 7.0))) == 1.0).all()


def test_velocity_reverses():
    assert command(mode(VelocityAction), [-1.0, 0.0]).linear == -0.2


def test_unknown_names_list_the_choices():
    with pytest.raises(UnknownNameError, match="did you mean 'wheels'"):
        look_up("action", ACTIONS, "wheel")
