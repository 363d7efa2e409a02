"""Parameters of the algorithms, one frozen dataclass each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pushplan.world.checked_fields import (
    CheckedFields,
    Each,
    Fraction,
    Limits,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveFraction,
    PositiveInt,
)

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
