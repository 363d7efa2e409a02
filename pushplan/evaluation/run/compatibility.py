"""Checks that a policy can be made at all, and that it is made for a scenario."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pushplan.control import ImmediateExecutor
from pushplan.evaluation.run.job_limits import EpisodeTimeout, soft_limit
from pushplan.evaluation.run.jobs import Job, JobSettings
from pushplan.evaluation.run.policy_specs import PolicySpec, UnusablePolicyError
from pushplan.world import (
    ChecksScenario,
    InvalidInputError,
    MaxIterations,
    PlansBesideDriving,
    Policy,
    PushplanError,
    World,
    stream,
)

if TYPE_CHECKING:
    from pushplan.scenarios import Suite


def misfits(
    specs: Sequence[PolicySpec],
    suites: Sequence[Suite],
    settings: JobSettings,
    *,
    only: Mapping[str, Sequence[str]] | None = None,
    allow_all: bool = False,
) -> dict[tuple[str, str], str]:
    """Make each policy once for each kind of scene, so that what cannot run is known before.

    Args:
        specs: the policies.
        suites: what they are to run.
        settings: of the environments.
        only: labels of the policies that a suite, by name, is for; else for all of them.
        allow_all: let a policy fit no suite at all.

    Returns:
        (suite, label) -> why that policy can run none of the suite's scenarios.

    Raises:
        UnusablePolicyError: if a policy cannot be made, or fits no suite.
        PushplanError: if a file of a suite, such as a world, cannot be used by any policy.
    """
    known: dict[tuple[str, str], str | None] = {}
    found: dict[tuple[str, str], str] = {}
    worlds: dict[tuple[str, str], World] = {}
    made: set[str] = set()
    starts = {
        suite.name: {(job := Job(specs[0], one)).scene: job for one in suite.scenarios}
        for suite in suites
    }
    for spec in specs:
        first = ""
        wanted = [one for one in suites if is_wanted(spec, one, only or {})]
        for suite in wanted:
            for scene, job in starts[suite.name].items():
                if (spec.label, scene) not in known:
                    known[spec.label, scene] = incompatibility(spec, job.scenario, settings, worlds)
                if (reason := known[spec.label, scene]) is None:
                    made.add(scene)
                    found.pop((suite.name, spec.label), None)
                    break
                found[suite.name, spec.label] = reason
                first = first or f"{job.title}: {reason}"
        if not allow_all and first and all((suite.name, spec.label) in found for suite in wanted):
            raise UnusablePolicyError(f"policy {spec.label!r} cannot run {first}")
    for suite in suites:
        wanted_by = [spec for spec in specs if is_wanted(spec, suite, only or {})]
        if all((suite.name, spec.label) in found for spec in wanted_by):
            continue
        for scene, job in starts[suite.name].items():
            if scene not in made:  # such as another world
                made.add(scene)
                settings.environment(job.scenario, None).close()
    return found


def is_wanted(spec: PolicySpec, suite: Suite, only: Mapping[str, Sequence[str]]) -> bool:
    """Return True if a policy is to run in a suite; ``only`` as in `misfits`."""
    return spec.label in only.get(suite.name, [spec.label])


def incompatibility(
    spec: PolicySpec,
    scenario: Any,
    settings: JobSettings,
    worlds: dict[tuple[str, str], World] | None = None,
) -> str | None:
    """Why a policy cannot run a scenario; None if it can.

    The policy is made, and so is its environment. A policy of ours and a network also take one
    step; code of a user is not asked for any, as only a worker process can end it by force.
    Starts are kept in ``worlds`` by scenario and action mode: their bodies take most of the time.

    Raises:
        UnusablePolicyError: if the policy cannot be made at all.
    """
    try:
        with soft_limit(settings.timeout_s):
            policy = spec.make()
    except EpisodeTimeout:
        raise UnusablePolicyError(
            f"policy {spec.label!r} cannot be made: not done after {settings.timeout_s:g} s"
        ) from None
    if isinstance(policy, ChecksScenario) and (reason := policy.incompatibility(scenario)):
        return reason
    try:
        env = settings.environment(scenario, policy)
    except PushplanError as error:
        return str(error)
    with contextlib.closing(env):
        if spec.is_ours:
            return _first_step(policy, scenario, env, {} if worlds is None else worlds)
    return None


def _first_step(
    policy: Policy, scenario: Any, env: Any, worlds: dict[tuple[str, str], World]
) -> str | None:
    """Why the policy refuses the start of a scenario; planning calls end after an iteration."""
    try:
        start = (scenario.key, env.action_mode)
        if start not in worlds:
            env.reset(seed=scenario.seed)
            worlds[start] = env.world
        world = worlds[start]
        observation = env.observation_builder.observe(world)
    except Exception:
        return None  # that is not the policy's fault
    try:
        policy.reset(world, stream(scenario.seed, "policy"))
        if isinstance(policy, PlansBesideDriving):
            policy.plan_with(ImmediateExecutor(MaxIterations(1)))
        policy.act(world, observation)
    except InvalidInputError as error:  # its way to refuse a world
        return str(error)
    except Exception:
        return None  # whatever else goes wrong is for the episodes to tell
    return None
