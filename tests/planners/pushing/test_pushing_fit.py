import numpy as np
import pytest
from pushing_scenes import SQUARE, in_front, make_simulator, run

from pushplan.planners.pushing import fit_push_model, identify, spread_of
from pushplan.planners.pushing.fit import main
from pushplan.world import InvalidInputError, Twist, area_clearing_robot, turtlebot3_burger


def recordings(name, robot, side, friction, bend, count=3, mass=None):
    """Pushes with random turns of up to ``bend`` / L, until the box is near the bumper's end."""
    found = []
    for seed in range(count):
        rng = np.random.default_rng(seed)
        offset = rng.uniform(-0.3, 0.3)
        world, model = in_front(robot, side, offset * model_half(robot, side), 0.1, mass)
        turns = rng.uniform(-bend, bend, 12) / model.reach
        period = 0.3 * model.reach / robot.max_speed / 4.0

        def command(seen, model=model, turns=turns, period=period):
            state = model.state(seen.robot_pose, seen.movables.poses[0])
            k = round(seen.time / period) // 4
            if k >= len(turns) or abs(state.offset) > 0.8 * model.bumper.half:
                return None
            return Twist(robot.max_speed, robot.max_speed * turns[k])

        found.append(run(make_simulator(name, world, friction), command, period, 60))
    return found


def model_half(robot, side):
    return in_front(robot, side)[1].bumper.half


@pytest.mark.parametrize("friction", [0.0, 0.2, 0.4])
def test_friction_is_found_in_pymunk(friction):
    episodes = recordings("pymunk", area_clearing_robot(), 1.0, friction, 0.9)
    fit = identify(episodes)
    assert fit.parameters.friction == pytest.approx(friction, abs=0.01)
    assert fit.friction_error < 0.01 and fit.rms < 0.01 and fit.windows >= 10
    assert fit_push_model(episodes) == fit.parameters


def test_how_the_ground_resists_turning_is_found():
    # far from the middle of the bumper boxes turn
    episodes = []
    for offset, bend in ((1.0, 0.3), (-1.05, -0.2), (0.95, 0.5), (-0.9, -0.6)):
        world, model = in_front(area_clearing_robot(), 1.0, offset, 0.3 * np.sign(offset))
        twist = Twist(0.2, 0.2 * bend / model.reach)
        simulator = make_simulator("pymunk", world, 0.2)
        episodes.append(run(simulator, lambda seen, twist=twist: twist, 0.2, 12))
    fit = identify(episodes)
    assert fit.parameters.spread == pytest.approx(spread_of("inertia", SQUARE), abs=0.15)


def test_light_boxes_in_mujoco_slide_as_if_friction_were_less():
    robot = turtlebot3_burger("pusher", max_speed=0.2, max_turn_rate=0.785)
    fit = identify(recordings("mujoco", robot, 0.08, 0.4, 0.6, mass=0.075))
    assert 0.05 < fit.parameters.friction < 0.35


def test_the_command(tmp_path, capsys):
    episodes = recordings("pymunk", area_clearing_robot(), 1.0, 0.3, 0.9, count=2)
    files = []
    for i, episode in enumerate(episodes):
        files.append(str(tmp_path / f"{i}.npz"))
        episode.save(files[-1])
    assert main(files) == 0
    assert capsys.readouterr().out.startswith(("friction 0.30", "friction 0.29"))
    assert main([str(tmp_path / "none.npz")]) == 1
    assert "not a readable episode" in capsys.readouterr().err


def test_recordings_without_pushes_are_refused():
    world, _ = in_front(area_clearing_robot(), 1.0)
    away = run(make_simulator("pymunk", world, 0.3), lambda seen: Twist(-0.2, 0.0), 0.2, 5)
    with pytest.raises(InvalidInputError, match="pieces of pushes"):
        identify([away])
    with pytest.raises(InvalidInputError, match="pieces of pushes"):
        fit_push_model([])
