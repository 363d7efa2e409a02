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
from pushplan.learned.loading import shipped_files
from pushplan.learned.outputs import OUTPUTS
from pushplan.learned.specification import builder_from_dict, from_mapping
from pushplan.world import InvalidInputError, SchemaError, UnknownNameError
from pushplan.world.checked_fields import (
    CheckedFields,
    Each,
    Fraction,
    Limits,
    NonNegativeFloat,
    NonNegativeInt,
    OneOf,
    PositiveFloat,
    PositiveFraction,
    PositiveInt,
)
from pushplan.world.checks import choice

Widths = Annotated[tuple[int, ...], Each(Limits(1))]


@dataclass(frozen=True)
class PpoOptions(CheckedFields):
    """Proximal policy optimisation (Schulman et al. 2017, arXiv 1707.06347)."""

    # learning rate at the start; it falls linearly to a tenth at the end
    rate: PositiveFloat = 3e-4
    rollout: PositiveInt = 512  # decisions of each environment between two updates
    batch: PositiveInt = 256  # decisions in a gradient step
    epochs: PositiveInt = 8  # passes over a rollout
    discount: Fraction = 0.99  # of a decision
    trace: Fraction = 0.95  # lambda of the generalised advantage
    clip: PositiveFloat = 0.2  # of the probability ratio
    entropy: NonNegativeFloat = 0.0  # weight of the entropy
    deviation: float = -0.5  # logarithm of the first standard deviation of actions
    widths: Widths = (128, 128)  # of the hidden layers, for actor and critic each


@dataclass(frozen=True)
class SacOptions(CheckedFields):
    """Soft actor-critic (Haarnoja et al. 2018, arXiv 1801.01290)."""

    rate: PositiveFloat = 5e-4  # learning rate
    buffer: PositiveInt = 200_000  # decisions that are remembered
    first: PositiveInt = 2_000  # random decisions before learning begins
    batch: PositiveInt = 256  # decisions in a gradient step
    every: PositiveInt = 8  # decisions of each environment between two rounds of updates
    updates: PositiveInt = 8  # gradient steps in such a round
    discount: Fraction = 0.99  # of a decision
    # fraction by which the target critics follow in each gradient step
    follow: PositiveFraction = 0.01
    widths: Widths = (128, 128)  # of the hidden layers


@dataclass(frozen=True)
class SamOptions(CheckedFields):
    """Double deep Q-learning on spatial action maps (Wu et al. 2020, arXiv 2004.09141)."""

    rate: PositiveFloat = 5e-4  # learning rate of Adam at the start; it falls linearly to a tenth
    buffer: PositiveInt = 20_000  # decisions that are remembered
    first: PositiveInt = 1_000  # decisions before learning begins
    batch: PositiveInt = 32  # decisions in a gradient step
    every: PositiveInt = 1  # decisions for each gradient step
    discount: Fraction = 0.85  # of a decision
    # decisions whose rewards are added up before the value of what is seen then
    lookahead: PositiveInt = 1
    # gradient steps between two copies of the network to the target
    target_every: PositiveInt = 500
    # fraction by which the target follows the network in each gradient step instead of being
    # copied; it is then their running average, is validated and becomes the policy
    follow: Fraction = 0.0
    # fraction of the decisions over which exploration falls from 1 to ``explore_end``
    explore: Fraction = 0.15
    explore_end: Fraction = 0.05  # probability of a random pixel then
    # fraction of the random pixels that are drawn around movable objects
    at_objects: Fraction = 0.5
    clip: PositiveFloat = 10.0  # greatest norm of the gradient
    # learn from mirrored maps as often as from others; both tasks are symmetric
    mirror: bool = True
    widths: Annotated[tuple[int, int], Each(Limits(1))] = (
        16,
        32,
    )  # channels at half and at a quarter of the map's resolution
    blocks: PositiveInt = 4  # residual blocks at a quarter
    # factor by which the network is coarser than that behind its first layer; 2 for maps of twice
    # the resolution
    shrink: PositiveInt = 1
    # shipped policy, or ONNX file, with the weights to begin with; its network must have the same
    # layers. Random ones by default.
    start: str = ""


@dataclass(frozen=True)
class BcOptions(CheckedFields):
    """Behaviour cloning: regression of the actions in a data set."""

    rate: PositiveFloat = 1e-3  # greatest learning rate of Adam, on a one-cycle schedule
    batch: PositiveInt = 256  # decisions in a gradient step
    held_out: Fraction = 0.1  # fraction of the episodes that only measure the error
    widths: Widths = (128, 128)  # of the hidden layers
    decay: NonNegativeFloat = 1e-5  # of the weights
    waves: NonNegativeInt = 0  # sines and cosines of each number of a vector that the network sees


@dataclass(frozen=True)
class FlowOptions(BcOptions):
    """Conditional flow matching (Lipman et al. 2022, arXiv 2210.02747) of chunks of actions.

    Chunks of which a few actions are carried out are those of diffusion policies (Chi et al. 2023,
    arXiv 2303.04137).
    """

    widths: Widths = (256, 256)  # of the hidden layers of the velocity
    euler: PositiveInt = 5  # steps of Euler's method from noise to a chunk


Options = PpoOptions | SacOptions | SamOptions | BcOptions | FlowOptions
OPTIONS: dict[str, type[Options]] = {
    "ppo": PpoOptions,
    "sac": SacOptions,
    "sam": SamOptions,
    "bc": BcOptions,
    "flow": FlowOptions,
}
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
