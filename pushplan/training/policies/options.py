"""Parameters of the algorithms, one frozen dataclass each."""

from __future__ import annotations

from dataclasses import dataclass

from pushplan.world import InvalidInputError
from pushplan.world.checked_fields import (
    CheckedFields,
    Fraction,
    NonNegativeFloat,
    PositiveFloat,
    PositiveFraction,
    PositiveInt,
)
from pushplan.world.checks import integer


class AlgorithmOptions(CheckedFields):
    """Base of the parameters of an algorithm: numbers, and the widths of its network."""

    widths: tuple[int, ...]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.widths, tuple) or not self.widths:
            raise InvalidInputError(f"widths must be a list of whole numbers, got {self.widths!r}")
        for width in self.widths:
            integer("width", width, low=1)


@dataclass(frozen=True)
class PpoOptions(AlgorithmOptions):
    """Proximal policy optimisation (Schulman et al. 2017, arXiv 1707.06347).

    Args:
        rate: learning rate at the start; it falls linearly to a tenth at the end.
        rollout: decisions of each environment between two updates.
        batch: decisions in a gradient step.
        epochs: passes over a rollout.
        discount: of a decision.
        trace: lambda of the generalised advantage.
        clip: of the probability ratio.
        entropy: weight of the entropy.
        deviation: logarithm of the first standard deviation of actions.
        widths: of the hidden layers, for actor and critic each.
    """

    rate: PositiveFloat = 3e-4
    rollout: PositiveInt = 512
    batch: PositiveInt = 256
    epochs: PositiveInt = 8
    discount: Fraction = 0.99
    trace: Fraction = 0.95
    clip: PositiveFloat = 0.2
    entropy: NonNegativeFloat = 0.0
    deviation: float = -0.5
    widths: tuple[int, ...] = (128, 128)


@dataclass(frozen=True)
class SacOptions(AlgorithmOptions):
    """Soft actor-critic (Haarnoja et al. 2018, arXiv 1801.01290).

    Args:
        rate: learning rate.
        buffer: decisions that are remembered.
        first: random decisions before learning begins.
        batch: decisions in a gradient step.
        every: decisions of each environment between two rounds of updates.
        updates: gradient steps in such a round.
        discount: of a decision.
        follow: fraction by which the target critics follow in each gradient step.
        widths: of the hidden layers.
    """

    rate: PositiveFloat = 5e-4
    buffer: PositiveInt = 200_000
    first: PositiveInt = 2_000
    batch: PositiveInt = 256
    every: PositiveInt = 8
    updates: PositiveInt = 8
    discount: Fraction = 0.99
    follow: PositiveFraction = 0.01
    widths: tuple[int, ...] = (128, 128)


@dataclass(frozen=True)
class SamOptions(AlgorithmOptions):
    """Double deep Q-learning on spatial action maps (Wu et al. 2020, arXiv 2004.09141).

    Args:
        rate: learning rate of Adam at the start; it falls linearly to a tenth.
        buffer: decisions that are remembered.
        first: decisions before learning begins.
        batch: decisions in a gradient step.
        every: decisions for each gradient step.
        discount: of a decision.
        lookahead: decisions whose rewards are added up before the value of what is seen then.
        target_every: gradient steps between two copies of the network to the target.
        follow: fraction by which the target follows the network in each gradient step instead of
            being copied; it is then their running average, is validated and becomes the policy.
        explore: fraction of the decisions over which exploration falls from 1 to ``explore_end``.
        explore_end: probability of a random pixel then.
        at_objects: fraction of the random pixels that are drawn around movable objects.
        clip: greatest norm of the gradient.
        mirror: learn from mirrored maps as often as from others; both tasks are symmetric.
        widths: channels at half and at a quarter of the map's resolution.
        blocks: residual blocks at a quarter.
        shrink: factor by which the network is coarser than that behind its first layer; 2 for maps
            of twice the resolution.
        start: shipped policy, or ONNX file, with the weights to begin with; its network must have
            the same layers. Random ones by default.
    """

    rate: PositiveFloat = 5e-4
    buffer: PositiveInt = 20_000
    first: PositiveInt = 1_000
    batch: PositiveInt = 32
    every: PositiveInt = 1
    discount: Fraction = 0.85
    lookahead: PositiveInt = 1
    target_every: PositiveInt = 500
    follow: Fraction = 0.0
    explore: Fraction = 0.15
    explore_end: Fraction = 0.05
    at_objects: Fraction = 0.5
    clip: PositiveFloat = 10.0
    mirror: bool = True
    widths: tuple[int, ...] = (16, 32)
    blocks: PositiveInt = 4
    shrink: PositiveInt = 1
    start: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.widths) != 2:
            raise InvalidInputError(f"widths of sam are two numbers, got {self.widths}")
        if not isinstance(self.start, str):
            raise InvalidInputError(f"start must be a policy's name or a file, got {self.start!r}")


@dataclass(frozen=True)
class BcOptions(AlgorithmOptions):
    """Behaviour cloning: regression of the actions in a data set.

    Args:
        rate: greatest learning rate of Adam, on a one-cycle schedule.
        batch: decisions in a gradient step.
        held_out: fraction of the episodes that only measure the error.
        widths: of the hidden layers.
        decay: of the weights.
    """

    rate: PositiveFloat = 1e-3
    batch: PositiveInt = 256
    held_out: Fraction = 0.1
    widths: tuple[int, ...] = (128, 128)
    decay: NonNegativeFloat = 1e-5


Options = PpoOptions | SacOptions | SamOptions | BcOptions
OPTIONS: dict[str, type[Options]] = {
    "ppo": PpoOptions,
    "sac": SacOptions,
    "sam": SamOptions,
    "bc": BcOptions,
}
