"""Whether a policy can be made at all, and whether it is made for a scenario."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from typing import Any

from pushplan.evaluation.episode import PolicyError, Recording
from pushplan.evaluation.jobs import Job, JobSettings
from pushplan.evaluation.limits import EpisodeTimeout, soft_limit
from pushplan.evaluation.policies import PolicySpec, parse_policies
from pushplan.world import ChecksScenario, InvalidInputError, Policy, PushplanError
from pushplan.world.errors import describe


class UnusablePolicyError(InvalidInputError):
    """A policy cannot be made, or is made for nothing that it is asked to run."""


def usable_policies(
    given: Any, scenarios: Sequence[Any], settings: JobSettings
) -> list[PolicySpec]:
    """Read policies, and make each once, so that what cannot run is refused before anything runs.

    Raises:
        UnknownNameError: if there is no policy of a name.
        UnusablePolicyError: if a policy cannot be made, or for none of the scenarios.
    """
    specs = read_policies(given)
    for spec in specs:
        starts = {Job(spec, scenario).title: scenario for scenario in scenarios}
        reasons: dict[str, str] = {}
        for title, scenario in starts.items():
            reason = incompatibility(spec, scenario, settings)
            if reason is None:
                reasons.clear()
                break
            reasons[title] = reason
        if reasons:
            title, reason = next(iter(reasons.items()))
            raise UnusablePolicyError(f"policy {spec.label!r} cannot run {title}: {reason}")
    return specs


def read_policies(given: Any) -> list[PolicySpec]:
    """`parse_policies`, with an error that says that nothing can run.

    Raises:
        UnknownNameError: if there is no policy of a name.
        UnusablePolicyError: if a text or a file can be no policy.
    """
    try:
        return parse_policies(given)
    except InvalidInputError as error:
        raise UnusablePolicyError(str(error)) from error


def incompatibility(spec: PolicySpec, scenario: Any, settings: JobSettings) -> str | None:
    """Why a policy cannot run a scenario; None if it can.

    The policy is made, and so is its environment. A policy of ours and a network also take one
    step; code of a user is not asked for any, as only a worker process can end it by force.

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
    except (Exception, SystemExit) as error:
        said = str(error) if isinstance(error, PushplanError) else describe(error)
        raise UnusablePolicyError(f"policy {spec.label!r} cannot be made: {said}") from error
    if isinstance(policy, ChecksScenario) and (reason := policy.incompatibility(scenario)):
        return reason
    try:
        env = settings.environment(scenario, policy)
    except PushplanError as error:
        return str(error)
    with contextlib.closing(env):
        if spec.is_ours:
            reason = _first_step(policy, scenario, env)
            if reason is None and settings.dry_run:
                spec.warm_up()  # what is compiled here, workers find in the cache
                env.warm_up()
            return reason
    return None


def _first_step(policy: Policy, scenario: Any, env: Any) -> str | None:
    try:
        Recording(policy, scenario).run(env, limit=1)
    except PolicyError as error:
        if isinstance(error.__cause__, InvalidInputError):  # its way to refuse a world
            return str(error.__cause__)
    return None  # whatever else goes wrong is for the episodes to tell
