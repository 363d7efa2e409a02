"""The optional abilities of a policy, and the action mode that fits one without them."""

from __future__ import annotations

import numpy as np
import pytest

from pushplan.envs import PushEnv
from pushplan.evaluation import InvalidActionError, Job, JobSettings, parse_policy, run_episode
from pushplan.evaluation.run.recording import Recording
from pushplan.learned import learned_names
from pushplan.planners import PlanFollower, make_policy, policy_names
from pushplan.scenarios import suite
from pushplan.world import (
    ChecksEnvironment,
    ChecksScenario,
    ChoosesActions,
    ChoosesObservation,
    HoldsDecisions,
    LogsPlans,
    PlansBesideDriving,
    Policy,
    ShowsPlan,
    Twist,
)

ROOM = suite("area-clearing-2d-10", episodes=1).scenarios[0]


class Straight:
    """Only what a policy has to have; drives straight on."""

    def reset(self, world, rng):
        self.start = world

    def act(self, world, observation):
        return Twist(0.2, 0.0)


class Wavers(Straight):
    """Begins with a heading, and then asks for a velocity."""

    def reset(self, world, rng):
        self.calls = 0

    def act(self, world, observation):
        self.calls += 1
        return np.zeros(1) if self.calls == 1 else Twist(0.2, 0.0)


@pytest.mark.parametrize("name", policy_names())
def test_classical_policies_have_the_abilities_of_their_kind(name):
    policy = make_policy(name)
    assert isinstance(policy, Policy) and isinstance(policy, ChoosesActions)
    planning = isinstance(policy, PlanFollower)
    for ability in (PlansBesideDriving, LogsPlans, ShowsPlan):
        assert isinstance(policy, ability) or not planning
    assert not isinstance(policy, ChoosesObservation | ChecksEnvironment | HoldsDecisions)


def test_networks_have_the_abilities_of_their_kind():
    policy = parse_policy(learned_names()[0]).make()
    for ability in (
        *(Policy, ChoosesActions, ChoosesObservation, ChecksEnvironment, ChecksScenario),
        HoldsDecisions,
    ):
        assert isinstance(policy, ability)
    assert not isinstance(policy, LogsPlans | PlansBesideDriving)


class PassesOn:
    """Has what another policy has, without a class that says so."""

    def __init__(self, inner: object) -> None:
        self._inner = inner

    def __getattr__(self, name: str) -> object:
        return getattr(self._inner, name)


def test_an_ability_is_what_the_policy_answers_not_what_its_class_holds():
    """Since Python 3.12 protocols look at the class alone."""
    inner = make_policy("kinodynamic-rrt")
    for ability in (Policy, ChoosesActions, PlansBesideDriving, LogsPlans, ShowsPlan):
        assert isinstance(inner, ability) and isinstance(PassesOn(inner), ability)
    assert not isinstance(PassesOn(inner), HoldsDecisions)

    class Bad(Straight):
        @property
        def plan_log(self):
            raise ValueError("no log")

    class Without(Straight):
        plan_with = None

        @property
        def plan_log(self):
            raise AttributeError("no log")

    with pytest.raises(ValueError, match="no log"):
        isinstance(Bad(), LogsPlans)
    assert not isinstance(Without(), LogsPlans | PlansBesideDriving)


def test_a_policy_that_gives_a_twist_gets_the_first_action_mode_that_takes_one():
    settings = JobSettings()
    episodes = []
    for policy in (Straight(), type("Stated", (Straight,), {"actions": ("velocity",)})()):
        env = settings.environment(ROOM, policy)
        recording = Recording(policy, ROOM, "the same")
        recording.run(env, limit=60)
        episodes.append(recording.episode())
        assert env.action_space.shape == (2,)
    assert episodes[0] == episodes[1]
    assert len(episodes[0].actions) == 60


def test_without_a_mode_that_fits_the_error_names_the_remedy():
    for env in (PushEnv(task="area_clearing", action="heading"), PushEnv(task="area_clearing")):
        policy = Straight() if env._may_adapt is False else Wavers()
        with pytest.raises(InvalidActionError, match=r"actions = \('velocity',\)"):
            run_episode(env, policy, ROOM)


@pytest.mark.slow
def test_a_job_of_such_a_policy_has_a_row():
    from pushplan.evaluation.run.execute import execute

    settings = JobSettings(dry_run=False)
    assert execute(Job(parse_policy(Straight), ROOM), settings).row.status == "done"
    assert execute(Job(parse_policy(Wavers), ROOM), settings).row.status == "invalid_action"
