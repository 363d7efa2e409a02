"""`TrainingConfig`: everything that decides what a training gives, in one YAML file."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Annotated, Any

from pushplan.envs.registry import SIMULATORS, TASKS, default_preset
from pushplan.files.safe_files import known_keys, read_data
from pushplan.learned.builders import builder_from_dict, from_mapping
from pushplan.learned.loading import shipped_files
from pushplan.learned.outputs import OUTPUTS
from pushplan.training.policies.options import OPTIONS, Options
from pushplan.world import InvalidInputError, SchemaError, UnknownNameError
from pushplan.world.checked_fields import (
    CheckedFields,
    Each,
    NonNegativeInt,
    OneOf,
    PositiveFloat,
    PositiveInt,
)
from pushplan.world.checks import choice

ALGORITHMS = tuple(OPTIONS)
IMITATING = ("bc", "flow")
"""Algorithms that learn from a data set."""
_OUTPUT_OF = {"pixel_values": "sam", "chunk": "flow"}


@dataclass(frozen=True)
class ActionChoice(CheckedFields):
    """Action mode, output and horizon of the network."""

    field_prefix = "action."

    mode: str  # action mode of the environment
    output: Annotated[str, OneOf(OUTPUTS)] = "continuous"  # see `pushplan.learned.ActionSpec`
    repeat: PositiveInt = 1  # control steps, or actions, for which a decision stands
    horizon: PositiveInt = 1  # actions of a chunk, of which the first ``repeat`` are carried out


@dataclass(frozen=True)
class TrainingConfig(CheckedFields):
    """Settings of a training. The same configuration, seed and machine give the same policy."""

    algorithm: Annotated[
        str, OneOf(ALGORITHMS)
    ]  # ``"ppo"``, ``"sac"``, ``"sam"``, ``"bc"``, ``"flow"``
    task: str  # name of the task
    # variations of the task; each episode draws one of them
    scenarios: tuple[Mapping[str, Any], ...]
    # of the network, as in a specification (``kind`` and its options)
    observation: Mapping[str, Any]
    action: ActionChoice  # action mode and output of the network
    options: Options  # of the algorithm
    simulator: str = "pymunk"  # name of the simulator
    preset: str | None = None  # of the task; the first for the simulator by default
    steps: PositiveInt = 100_000  # decisions to learn from
    seed: NonNegativeInt = 0  # of weights, exploration and starts
    envs: PositiveInt = 4  # environments that run side by side
    # decisions between two checkpoints, each with a validation. Every chunk starts with fresh
    # episodes and generators of its own, so that a resumed training continues exactly.
    chunk: PositiveInt = 10_000
    reward_scale: PositiveFloat = 1.0  # factor of the task's reward
    # decisions after which a training episode is cut off, 0 for the task's own end
    limit: NonNegativeInt = 0
    validation: NonNegativeInt = 20  # episodes of each validation
    # on which the result is scored, with scenarios that training never draws
    suites: Annotated[tuple[str, ...], Each(least=0)] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        choice("task", self.task, tuple(TASKS))
        choice("simulator", self.simulator, tuple(SIMULATORS))
        if self.preset is None:
            object.__setattr__(self, "preset", default_preset(self.task, self.simulator))
        if not self.scenarios:
            raise InvalidInputError("scenarios must hold at least one mapping of variations")
        if not isinstance(self.options, OPTIONS[self.algorithm]):
            raise InvalidInputError(
                f"the options of {self.algorithm!r} are {OPTIONS[self.algorithm].__name__}, got "
                f"{type(self.options).__name__}"
            )
        builder_from_dict(self.observation)
        for output, algorithm in _OUTPUT_OF.items():
            if (self.action.output == output) != (self.algorithm == algorithm):
                raise InvalidInputError(
                    f"algorithm {self.algorithm!r} cannot train output {self.action.output!r}: "
                    f"{output} belongs to {algorithm}"
                )

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> TrainingConfig:
        """Read what `to_dict` gives, or a configuration file holds.

        Raises:
            SchemaError, InvalidInputError, UnknownNameError: if a key or a value is wrong.
        """
        kind = "the training configuration"
        needed = ("algorithm", "task", "scenarios", "observation", "action")
        known_keys(kind, data, [field.name for field in fields(cls)], needed)
        algorithm = choice("algorithm", data["algorithm"], ALGORITHMS)
        given = data["scenarios"]
        if not isinstance(given, list | tuple):
            raise SchemaError(f"scenarios must be a list, got {given!r:.60}")
        if not all(isinstance(one, Mapping) for one in given):
            raise SchemaError("each of scenarios must be a mapping of variations")
        options = OPTIONS[algorithm]
        parts = {
            "action": from_mapping(ActionChoice, "action", data["action"]),
            "options": from_mapping(options, f"options of {algorithm}", data.get("options", {})),
        }
        config: TrainingConfig = from_mapping(cls, kind, {**data, **parts})
        return config

    def to_dict(self) -> dict[str, Any]:
        """JSON values."""
        data: dict[str, Any] = json.loads(json.dumps(asdict(self)))  # tuples as lists
        return data

    def changed(self, **changes: Any) -> TrainingConfig:
        """The same with other values, such as ``steps`` and ``seed``; None changes nothing."""
        wanted = {key: value for key, value in changes.items() if value is not None}
        return dataclasses.replace(self, **wanted)


def read_config(path: str | Path) -> TrainingConfig:
    """A configuration from a YAML file.

    Raises:
        SchemaError: if it cannot be read, or something in it is wrong.
    """
    data = read_data(path, "configuration")
    try:
        return TrainingConfig.from_dict(data)
    except InvalidInputError as error:
        raise SchemaError(f"{path}: {error}") from error


def shipped_configs() -> dict[str, Path]:
    """The configurations that come with the package, by name, such as ``maze-ppo``."""
    return shipped_files("pushplan.training.policies", "configs/*.yaml")


def config_named(task: str, algorithm: str) -> TrainingConfig:
    """The shipped configuration of a task and an algorithm.

    Raises:
        UnknownNameError: if there is none.
    """
    known = shipped_configs()
    name = f"{task.replace('_', '-')}-{algorithm}"
    if name not in known:
        raise UnknownNameError("training configuration", name, known)
    return read_config(known[name])
