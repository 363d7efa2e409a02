"""A stress test: a row for each condition, and what was missed."""

from __future__ import annotations

from dataclasses import replace

import pytest

from pushplan.envs import make
from pushplan.evaluation import Condition, stress, stress_testing
from pushplan.evaluation.stress_testing import CONDITIONS, UNDISTURBED
from pushplan.runtime.disturbed_policy import Disturbances
from pushplan.scenarios import Scenario, suite
from pushplan.world import InvalidInputError, Twist, UnknownNameError


def test_a_policy_that_stands_it_misses_nothing():
    given = {"conditions": ["noise-1cm-2deg"], "episodes": 1, "seed": 2, "workers": 0}
    sheet = stress("straight", "maze-3d-3", **given)
    calm, noisy = sheet.rows
    assert (calm.condition, noisy.condition) == (UNDISTURBED, "noise-1cm-2deg")
    assert calm.successes == calm.episodes == noisy.successes == 1
    assert calm.ends == {}
    assert calm.kept["E_nav"] == 1.0
    assert noisy.scores["E_nav"] != calm.scores["E_nav"]
    assert noisy.kept["E_nav"] == noisy.scores["E_nav"] / calm.scores["E_nav"]
    assert sheet.missed == ()


@pytest.mark.slow
def test_a_sheet_repeats():
    given = {"conditions": ["noise-1cm-2deg"], "episodes": 1, "seed": 2, "workers": 0}
    assert stress("straight", "maze-3d-3", **given) == stress("straight", "maze-3d-3", **given)


def test_what_is_missed_is_said_and_why():
    own = {
        "asked": Condition(Disturbances(delay=0.2), success=0.5),
        "free": Condition(Disturbances(delay=0.2), success=None),
    }
    sheet = stress("random", "maze-3d-3", conditions=own, episodes=2, workers=0)
    rows = {row.condition: row for row in sheet.rows}
    assert rows["asked"].ends == {"wall": 2}
    assert rows["asked"].missed == ("success ≥ 0.5", "no wall")
    assert rows["free"].missed == ()
    assert sheet.missed == (UNDISTURBED, "asked")
    table = sheet.table()
    cells = dict(zip(table.headings, table.cells[1], strict=True))
    assert cells["without success"] == "2 wall"
    assert cells["missed"] == "success ≥ 0.5; no wall"


def test_what_makes_no_sense_is_one_error():
    with pytest.raises(UnknownNameError, match="condition"):
        stress("straight", "maze-2d-3", conditions=["fog"], episodes=1, workers=0)
    with pytest.raises(InvalidInputError, match="rate must lie"):
        stress("straight", "maze-2d-3", rate=0.0, episodes=1, workers=0)
    with pytest.raises(InvalidInputError, match="robot with sensors: sensing must be"):
        stress("straight", "maze-2d-3", conditions=["sensor-noise"], episodes=1, workers=0)
    with pytest.raises(InvalidInputError, match="at least one scenario"):
        stress("straight", [], workers=0)


@pytest.mark.slow
def test_by_default_all_conditions_on_any_task():
    ran = [row.condition for row in stress("random", "ship-ice-2d-0", episodes=1, workers=0).rows]
    assert ran == [name for name, one in CONDITIONS.items() if not one.of_sensors]


@pytest.mark.slow
def test_conditions_of_sensors_change_what_a_robot_with_sensors_sees():
    wanted = ["sensor-noise", "sensor-drop-out-30", "sensor-delay-200ms"]
    given = {"conditions": wanted, "episodes": 1, "seed": 4, "workers": 0}
    sheet = stress("kinodynamic-rrt", "maze-3d-6-lidar", **given)
    assert [row.condition for row in sheet.rows] == [UNDISTURBED, *wanted]
    lengths = {row.condition: row.scores["E_nav"] for row in sheet.rows}
    assert len(set(lengths.values())) == 4 and not any("wall" in row.ends for row in sheet.rows)


def test_by_default_sensors_are_disturbed_only_where_every_robot_has_some(monkeypatch):
    ran = []

    def stopped(jobs, **options):
        ran.extend(jobs)
        raise KeyboardInterrupt

    monkeypatch.setattr(stress_testing, "run_batch", stopped)
    starts = [
        Scenario("maze", variations={"boxes": 1, "sensing": one}) for one in ("lidar", "full")
    ]
    with pytest.raises(KeyboardInterrupt):
        stress("straight", starts, workers=0)
    assert {job.policy.label for job in ran} == {
        name for name, one in CONDITIONS.items() if not one.of_sensors
    }


def short(name, episodes):
    """Scenarios of a suite that are cut off early: `Runner` stops the robot before the walls."""
    return [
        replace(one, variations={**one.variations, "time_limit": 3.0})
        for one in suite(name).scenarios[:episodes]
    ]


def test_a_policy_is_told_the_noise_of_sensors():
    told = []

    class Ahead:
        actions = ("velocity",)

        def reset(self, world, rng):
            told.append((0.0, 0.0))

        def expect_noise(self, position, heading):
            told.append((position, heading))

        def act(self, world, observation=None):
            return Twist(0.3, 0.0)

    stress(Ahead, short("maze-3d-6-lidar", 1), conditions=["sensor-noise"], workers=0)
    assert told[0] == (0.0, 0.0)
    assert any(0.0 < place < 0.02 and 0.0 < heading < 0.06 for place, heading in told)


def test_under_unknown_parameters_a_policy_is_told_the_nominal_ones():
    episodes = []

    class Straight:
        actions = ("velocity",)

        def reset(self, world, rng):
            episodes.append(world.movables)

        def act(self, world, observation=None):
            return Twist(0.1, 0.0)

    given = {"conditions": ["parameters-unknown"], "workers": 0}
    rows = stress(Straight, short("maze-3d-3", 2), **given).rows
    scenario = suite("maze-3d-3").scenarios[0]
    condition = CONDITIONS["parameters-unknown"]
    env = make(replace(scenario, variations={**scenario.variations, **condition.variations}))
    env.reset(seed=scenario.seed)
    assert (env.true_world.movables.masses != 0.1).all()
    assert [row.condition for row in rows] == [UNDISTURBED, "parameters-unknown"]
    assert episodes and all((objects.masses == 0.1).all() for objects in episodes)
    assert stress(Straight, short("maze-3d-3", 2), **given).rows == rows
