"""Passages through random ice, with what the simulator says happens: the truth to learn."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from pushplan.envs.simulators.pymunk_simulator import PymunkSimulator
from pushplan.envs.tasks.ship_ice import ShipIceTask
from pushplan.interaction.interaction_model import Interaction
from pushplan.interaction.occupancy import (
    OccupancyForecast,
    Passage,
    PassageBatch,
    make_batch,
    patch_after,
)
from pushplan.world import World, stream
from pushplan.world.checked_fields import CheckedFields, Limits, PositiveInt
from pushplan.world.checks import FloatArray, number

SPLITS = ("train", "held-out")


SHORTEST = 0.2
LONGEST = 1.2
"""Length of a passage, in hull lengths."""
ARCS = (0.15, 1.0)
"""Least and greatest length of the arcs that a voyage is made of, in hull lengths."""
SPACING = 0.05
"""Between the poses of a voyage, in hull lengths."""
STEEPEST = math.radians(75.0)
"""Greatest angle between the ship and the channel [rad]."""
ALONG = 0.3
"""Angle to the channel below which a ship near a side turns to the middle, else to the channel
[rad]."""
STRAIGHT_FRACTION = 0.25
"""Fraction of the arcs that are straight."""
LONGEST_VOYAGE = 4000
"""Most poses of a voyage, which may never get to the end of the channel."""


@dataclass(frozen=True)
class PassageConfig(CheckedFields):
    """Settings of the passages that are drawn."""

    # of the ice, drawn from ``least_concentration`` to this
    greatest_concentration: Annotated[float, Limits(0.0, 0.5)] = 0.5
    least_concentration: float = 0.01  # fraction of ice
    passages: PositiveInt = 48  # drawn from each voyage along the channel

    def __post_init__(self) -> None:
        super().__post_init__()
        most = self.greatest_concentration
        number("least_concentration", self.least_concentration, low=0.0, high=most)


def random_voyage(world: World, rng: np.random.Generator) -> FloatArray:
    """A path along the channel in arcs of random length and curvature.

    Returns:
        (N, 3) poses, `SPACING` apart, that keep clear of the channel's ends. They may
        pass its sides by up to a hull length.
    """
    length = float(np.ptp(world.robot.vertices[:, 0]))
    tightest = 1.0 / world.robot.turning_radius
    step = SPACING * length
    x_low, _, x_high, y_high = world.static.bounds.tolist()
    x, y, theta = world.robot_pose.tolist()
    poses = [(x, y, theta)]
    while y < y_high - 1.5 * length and len(poses) < LONGEST_VOYAGE:
        curvature = 0.0
        if rng.random() >= STRAIGHT_FRACTION:
            curvature = rng.choice([-1.0, 1.0]) * tightest * rng.uniform(0.1, 1.0)
        off = theta - 0.5 * math.pi
        if abs(off) > STEEPEST or x < x_low + length or x > x_high - length:
            wanted = off
            if abs(off) < ALONG:
                wanted = 0.5 * (x_low + x_high) - x
            curvature = -math.copysign(tightest, wanted)
        for _ in range(max(1, round(rng.uniform(*ARCS) * length / step))):
            middle = theta + 0.5 * curvature * step
            x += step * math.cos(middle)
            y += step * math.sin(middle)
            theta += curvature * step
            poses.append((x, y, theta))
            off = theta - 0.5 * math.pi
            if abs(off) > STEEPEST and curvature * off > 0.0:
                break
    return np.array(poses)


def voyage_passages(
    seed: int, split: str = "train", config: PassageConfig | None = None
) -> tuple[PassageBatch, OccupancyForecast]:
    """Passages of one simulated voyage through fresh ice, and what the simulator made of them.

    Later passages meet ice that the ship has moved before, and its own open wake.

    Args:
        seed: of the ice, the voyage and the choice of passages.
        split: ``"train"`` or ``"held-out"``; the same seed gives other ice in the other.
        config: what is drawn.
    """
    config = PassageConfig() if config is None else config
    rng = stream(seed, f"ice passages {split}")
    fraction = rng.uniform(config.least_concentration, config.greatest_concentration)
    task = ShipIceTask(
        variations={
            "concentration": float(fraction),
            "clumping": float(rng.uniform()),
            "goal_distance": 39.0,
        }
    )
    world = task.start(rng)
    voyage = random_voyage(world, rng)
    simulator = PymunkSimulator()
    simulator.build(world, task.materials)
    moved = simulator.follow(voyage)
    passages, ends = _choose(world, voyage, moved, config, rng)
    batch = make_batch(passages)
    after = np.stack(
        [patch_after(batch, i, moved.object_poses[b]) for i, (_, b) in enumerate(ends)]
    )
    work = [Interaction(moved.object_poses[a : b + 1], moved.masses).work for a, b in ends]
    return batch, OccupancyForecast(after, np.array(work))


def _choose(
    world: World,
    voyage: FloatArray,
    moved: Interaction,
    config: PassageConfig,
    rng: np.random.Generator,
) -> tuple[list[Passage], list[tuple[int, int]]]:
    """Pieces of a voyage, from the poses with the first number to those with the second."""
    last = len(voyage) - 1
    if moved.jammed_at >= 0:
        last = moved.jammed_at - 1
    shortest, longest = (max(1, round(fraction / SPACING)) for fraction in (SHORTEST, LONGEST))
    passages = []
    ends = []
    for _ in range(config.passages):
        count = int(rng.integers(shortest, longest + 1))
        first = int(rng.integers(0, max(1, last - count + 1)))
        there = replace(
            world,
            robot_pose=voyage[first],
            movables=world.movables.moved_to(moved.object_poses[first]),
        )
        end = min(first + count, last)
        passages.append(Passage(there, voyage[first : end + 1]))
        ends.append((first, end))
    return passages, ends
