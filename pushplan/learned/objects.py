"""Any Python object with ``predict`` as a policy."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np

from pushplan.world import Action, InvalidInputError, Twist, WheelSpeeds, World


class ObjectPolicy:
    """Wraps an object with ``predict(observation, deterministic=True)``, as Stable-Baselines3.

    ``predict`` gives an action, or a pair whose first entry is one (the second, a recurrent state,
    is handed back at the next step where ``predict`` takes ``state``).

    Args:
        thing: the object. Its attributes ``observation`` (name or builder) and ``actions`` (modes
            in order of preference), if it has them, say what the environment must be like; its
            ``observation_space``, if it has one, is compared with the environment's.
        label: what errors call it.
    """

    def __init__(self, thing: Any, label: str = "policy") -> None:
        if not callable(getattr(thing, "predict", None)):
            raise InvalidInputError(f"policy {label!r} has no method predict")
        self.thing = thing
        self.label = label
        self._takes_state = _takes(thing.predict, "state")
        self._deterministic = _takes(thing.predict, "deterministic")
        self._state: Any = None
        for name in ("observation", "actions"):
            if hasattr(thing, name):
                setattr(self, name, getattr(thing, name))

    def __repr__(self) -> str:
        return f"ObjectPolicy({self.thing!r:.60}, {self.label!r})"

    def check_environment(self, env: Any, scenario: Any = None) -> None:
        """Refuse an environment that observes something else than the object expects.

        Raises:
            InvalidInputError: naming both sides.
        """
        for name in ("observation_space", "action_space"):
            mine = getattr(self.thing, name, None)
            theirs = getattr(env, name, None)
            if mine is None or theirs is None:
                continue
            if mine.shape != theirs.shape or mine.dtype != theirs.dtype:
                raise InvalidInputError(
                    f"policy {self.label!r} has an {name.replace('_', ' ')} {mine.dtype} of shape "
                    f"{mine.shape}, the environment has {theirs.dtype} of shape {theirs.shape}"
                )

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Forget the last episode; calls the object's own ``reset()`` if it takes no arguments."""
        self._state = None
        reset = getattr(self.thing, "reset", None)
        if callable(reset) and _needs_nothing(reset):
            reset()

    def act(self, world: World, observation: Any) -> Action:
        """Return the action that the object predicts."""
        options: dict[str, Any] = {"deterministic": True} if self._deterministic else {}
        if self._takes_state:
            options["state"] = self._state
        result = self.thing.predict(observation, **options)
        if isinstance(result, tuple) and len(result) == 2:
            result, self._state = result
        if isinstance(result, Twist | WheelSpeeds):
            return result
        action: Action = np.asarray(result, dtype=np.float64)
        return action


def _takes(function: Callable[..., Any], name: str) -> bool:
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return False
    return any(p.name == name or p.kind is inspect.Parameter.VAR_KEYWORD for p in parameters)


def _needs_nothing(function: Callable[..., Any]) -> bool:
    """Return True if a function can be called without arguments."""
    try:
        inspect.signature(function).bind()
    except (TypeError, ValueError):
        return False
    return True
