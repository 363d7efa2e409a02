"""`describe`: the specification of whatever learns in an environment."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from pushplan.learned.outputs import MODES, ActionSpec
from pushplan.learned.specification import RobotSpec, Specification, builder_to_dict
from pushplan.observation import ObservationBuilder
from pushplan.world import InvalidInputError, UnknownNameError

_CHANGING = frozenset(
    ("ObservationWrapper", "ActionWrapper", "FrameStackObservation", "MaxAndSkipObservation")
)
"""Classes of Gymnasium's wrappers after which a policy sees or does something else."""


def describe(
    env: Any, *, repeat: int = 1, training: Mapping[str, Any] | None = None
) -> Specification:
    """The specification of a network that learns in an environment, from the environment itself.

    Wrappers that leave observations and actions alone are looked through (``Monitor``,
    ``TimeLimit``, those of rewards), and so are the vector environments of Stable-Baselines3 whose
    environments live in this process. A wrapper that carries out each action several times cannot
    be seen from here: say so with ``repeat``.

    Args:
        env: a `pushplan.envs.PushEnv`, with or without wrappers; a vector of some; or another
            environment with a ``specification``, as `pushplan train` uses.
        repeat: steps for which a decision stands.
        training: facts for people and model cards; for a file of Stable-Baselines3 ``algorithm``.

    Raises:
        InvalidInputError: if it is no environment of pushplan, if a wrapper changes what a policy
            sees or does, if the observation is a builder of one's own, or if the environments of
            a vector differ.
        UnknownNameError: if no file can describe the action mode.
    """
    layers = list(_layers(env))
    single = getattr(layers[-1], "envs", None)
    if single:
        found = [describe(one, repeat=repeat, training=training) for one in single]
        if any(other != found[0] for other in found):
            raise InvalidInputError(
                "the environments of a vector must have task, robot, observation and action in "
                f"common to be described, got {found[0].to_json()} beside another"
            )
        specification = found[0]
    else:
        specification = _of_one(layers[-1], repeat, training or {})
    for outer in layers:
        _check(outer, specification)
    return specification


def _layers(env: Any) -> Iterator[Any]:
    """An environment and what it wraps, the innermost last."""
    while env is not None:
        yield env
        env = getattr(env, "venv", None) or getattr(env, "env", None)


def _of_one(env: Any, repeat: int, training: Mapping[str, Any]) -> Specification:
    own = getattr(env, "specification", None)
    if isinstance(own, Specification):
        return replace(own, training={**own.training, **training})
    task = getattr(env, "task", None)
    builder = getattr(env, "observation_builder", None)
    if task is None or builder is None:
        raise InvalidInputError(
            "only environments of pushplan can be described, such as gymnasium.make("
            f'"pushplan/Maze-v0") in this process, got {type(env).__name__}: '
            "describe one such environment, or write the specification by hand (docs/learned.md)"
        )
    mode = env.action_mode
    if mode not in MODES:
        raise UnknownNameError("action mode in a specification", mode, MODES)
    builder_to_dict(builder)  # refuses builders of one's own
    action = ActionSpec(
        mode=mode,
        output="continuous",
        shape=(MODES[mode],),
        repeat=repeat,
        step=task.heading_step if mode == "heading" else 0.0,
    )
    return specification_of(task, builder, action, training)


def specification_of(
    task: Any, observation: ObservationBuilder, action: ActionSpec, training: Mapping[str, Any]
) -> Specification:
    """The specification of a network that learns a task."""
    preset = getattr(getattr(task, "preset", None), "name", None)
    return Specification(
        tasks=(task.name,),
        presets=() if preset is None else (preset,),
        robot=RobotSpec.of(task.robot),
        control_step=task.control_step,
        observation=observation,
        action=action,
        training=training,
    )


def _check(env: Any, specification: Specification) -> None:
    """Refuse a wrapper after which observations or actions are other ones."""
    name = type(env).__name__
    kinds = {kind.__name__ for kind in type(env).__mro__}
    if kinds & _CHANGING or getattr(env, "norm_obs", False):
        raise InvalidInputError(
            f"{name} changes what a policy sees or does, which a specification cannot say: leave "
            "it out, or put it into the network (rewards may be changed)"
        )
    spaces = (
        ("observation_space", specification.observation.shape),
        ("action_space", specification.action.shape),
    )
    for kind, shape in spaces:
        space = getattr(env, kind, None)
        if space is not None and space.shape != shape:
            raise InvalidInputError(
                f"{name} has the {kind.replace('_', ' ')} {space!s:.80}, where the policy that is "
                f"described needs shape {shape}"
            )
