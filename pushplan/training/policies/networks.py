"""The networks, in PyTorch. Import it only where PyTorch is there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional as F

IMAGE_SCALE = 255.0


class SmallEncoder(nn.Module):
    """Four strided convolutions and a linear layer, for images of 32 to 96 pixels."""

    def __init__(self, channels: int, pixels: tuple[int, int], outputs: int = 128) -> None:
        super().__init__()
        hidden: list[nn.Module] = []
        for inside, outside in pairwise((channels, 16, 32, 32, 32)):
            size = 3 if hidden else 5
            hidden.append(nn.Conv2d(inside, outside, size, stride=2, padding=size // 2))
            hidden.append(nn.ReLU())
        self.layers = nn.Sequential(*hidden, nn.Flatten())
        with torch.no_grad():
            flat = self.layers(torch.zeros(1, channels, *pixels)).shape[1]
        self.head = nn.Sequential(nn.Linear(flat, outputs), nn.ReLU())

    def forward(self, images: Tensor) -> Tensor:
        """(B, outputs) from (B, C, H, W) in [0, 1]."""
        encoded: Tensor = self.head(self.layers(images))
        return encoded


def layers(inputs: int, widths: Sequence[int], outputs: int) -> nn.Sequential:
    """A perceptron with ReLU between its layers."""
    sizes = [inputs, *widths]
    hidden: list[nn.Module] = []
    for a, b in pairwise(sizes):
        hidden += [nn.Linear(a, b), nn.ReLU()]
    return nn.Sequential(*hidden, nn.Linear(sizes[-1], outputs))


class Encoder(nn.Module):
    """Observation to vector: images in [0, 255] by a `SmallEncoder`, vectors with their waves.

    Args:
        shape: of an observation.
        waves: for each number x of a vector sin and cos of pi x, 2 pi x, 4 pi x and so on are added
            to it, so many of each. Perceptrons are slow to learn what changes within a small part
            of the range (Tancik et al. 2020, arXiv 2006.10739).
    """

    def __init__(self, shape: tuple[int, ...], waves: int = 0) -> None:
        super().__init__()
        self.is_image = len(shape) == 3
        self.layers: nn.Module = nn.Identity()
        self.factors = [math.pi * 2.0**i for i in range(waves)]
        self.outputs = shape[0] * (1 + 2 * waves)
        if self.is_image:
            self.layers = SmallEncoder(shape[0], (shape[1], shape[2]))
            self.outputs = 128

    def forward(self, observations: Tensor) -> Tensor:
        """(B, outputs)."""
        seen = observations.float()
        if self.is_image:
            seen = seen / IMAGE_SCALE
        elif self.factors:
            angles = [factor * seen for factor in self.factors]
            seen = torch.cat([seen, *map(torch.sin, angles), *map(torch.cos, angles)], dim=1)
        encoded: Tensor = self.layers(seen)
        return encoded


class DirectPolicy(nn.Module):
    """Observation to action, for behaviour cloning; images in [0, 255] or vectors."""

    def __init__(
        self, shape: tuple[int, ...], widths: Sequence[int], outputs: int, waves: int
    ) -> None:
        super().__init__()
        self.encoder = Encoder(shape, waves)
        self.body = layers(self.encoder.outputs, widths, outputs)

    def forward(self, observations: Tensor) -> Tensor:
        """(B, outputs) in [-1, 1]."""
        return torch.tanh(self.body(self.encoder(observations)))

    def loss(self, observations: Tensor, wanted: Tensor, counted: Tensor) -> Tensor:
        """Smooth error of the outputs; all of them count."""
        return F.smooth_l1_loss(self(observations), wanted)


class _Residual(nn.Module):
    def __init__(self, width: int, dilation: int) -> None:
        super().__init__()
        self.first = nn.Conv2d(width, width, 3, padding=dilation, dilation=dilation)
        self.second = nn.Conv2d(width, width, 3, padding=1)

    def forward(self, x: Tensor) -> Tensor:
        return F.relu(x + self.second(F.relu(self.first(x))))


class SpatialActionNetwork(nn.Module):
    """A value for each pixel of the map around the robot.

    Fully convolutional, after Wu et al. 2020 (arXiv 2004.09141), small enough for a processor:
    residual blocks at a quarter of the resolution, of which some are dilated so that each pixel
    sees the whole map, a skip from half the resolution, and a pixel shuffle to the full one.

    Args:
        channels: of the map.
        widths: channels at half and at a quarter of the resolution.
        blocks: residual blocks.
        shrink: factor by which everything after the first layer is coarser still; values are
            interpolated between.
    """

    set_training_mode = nn.Module.train
    """As Stable-Baselines3 calls it."""

    def __init__(
        self,
        channels: int,
        widths: tuple[int, ...] = (16, 32),
        blocks: int = 4,
        shrink: int = 1,
    ) -> None:
        super().__init__()
        half, quarter = widths
        self.shrink = shrink
        reach = 2 * shrink
        self.first = nn.Conv2d(channels, half, 2 * reach + 1, stride=reach, padding=reach)
        self.second = nn.Conv2d(half, quarter, 3, stride=2, padding=1)
        dilations = [(1, 2, 4)[i % 3] for i in range(blocks)]
        self.blocks = nn.Sequential(*(_Residual(quarter, d) for d in dilations))
        self.rise = nn.Conv2d(quarter, 4 * half, 1)
        self.mix = nn.Conv2d(half, half, 3, padding=1)
        self.values = nn.Conv2d(half, 4, 1)

    def forward(self, maps: Tensor) -> Tensor:
        """(B, H, W) values from (B, C, H, W) maps, 0 to 255; H, W divisible by 4 times shrink."""
        high = F.relu(self.first(maps.float() / IMAGE_SCALE))
        low = self.blocks(F.relu(self.second(high)))
        high = F.relu(high + F.pixel_shuffle(self.rise(low), 2))
        high = F.relu(high + self.mix(high))
        values = F.pixel_shuffle(self.values(high), 2)
        if self.shrink > 1:
            values = F.interpolate(values, scale_factor=float(self.shrink), mode="bilinear")
        return values[:, 0]


class SquashedActor(nn.Module):
    """The deterministic action of a Stable-Baselines3 policy, for export."""

    def __init__(self, policy: Any, is_image: bool) -> None:
        super().__init__()
        self.is_image = is_image
        self.squash = hasattr(policy, "actor")
        if self.squash:
            self.features = policy.actor.features_extractor
            self.body = policy.actor.latent_pi
            self.mean = policy.actor.mu
        else:
            self.features = policy.pi_features_extractor
            self.body = policy.mlp_extractor.policy_net
            self.mean = policy.action_net

    def forward(self, observations: Tensor) -> Tensor:
        """(B, actions) in [-1, 1]."""
        seen = observations.float()
        if self.is_image:
            seen = seen / IMAGE_SCALE
        mean = self.mean(self.body(self.features(seen)))
        return torch.tanh(mean) if self.squash else mean.clamp(-1.0, 1.0)


class FlowPolicy(nn.Module):
    """Observation to a chunk of actions along a learned velocity field.

    Conditional flow matching (Lipman et al. 2022, arXiv 2210.02747, equations 20 to 23 with no
    noise left at the end): the velocity is fitted to ``chunk - noise`` on the straight lines
    between Gaussian noise and the chunks of a data set. A decision follows it from fresh noise by
    Euler's method, so it is one of the things that were done in such a case, not their mean.

    Args:
        shape: of an observation, image in [0, 255] or vector.
        widths: of the hidden layers of the velocity.
        chunk: actions of a chunk, and elements of an action.
        euler: steps of Euler's method.
        waves: of a vector, see `Encoder`.
    """

    def __init__(
        self,
        shape: tuple[int, ...],
        widths: Sequence[int],
        chunk: tuple[int, ...],
        euler: int,
        waves: int,
    ) -> None:
        super().__init__()
        self.chunk = chunk
        self.euler = euler
        self.encoder = Encoder(shape, waves)
        size = math.prod(chunk)
        self.noise = (size,)
        self.of_seen = nn.Linear(self.encoder.outputs, widths[0])
        self.of_chunk = nn.Linear(size, widths[0], bias=False)
        self.of_time = nn.Linear(1, widths[0], bias=False)
        self.body = layers(widths[0], widths[1:], size)

    def forward(self, observations: Tensor, noise: Tensor | None = None) -> Tensor:
        """(B, horizon, n) actions in [-1, 1].

        Args:
            observations: (B, ...).
            noise: (B, horizon n) Gaussian; drawn if None.
        """
        context = self.of_seen(self.encoder(observations))
        chunk = noise
        if chunk is None:
            chunk = torch.randn(len(context), *self.noise)
        for step in range(self.euler):
            time = torch.tensor([[step / self.euler]])
            chunk = chunk + self._velocity(context, chunk.to(context), time) / self.euler
        actions: Tensor = chunk.clamp(-1.0, 1.0).reshape(-1, *self.chunk)
        return actions

    def loss(self, observations: Tensor, wanted: Tensor, counted: Tensor) -> Tensor:
        """Squared error of the velocity at a random time on the way from noise to each chunk.

        Args:
            observations: (B, ...).
            wanted: (B, horizon, n) chunks.
            counted: (B, horizon) weights of their actions.
        """
        end = wanted.flatten(1)
        noise = torch.randn_like(end)
        time = torch.rand(len(end), 1, device=end.device)
        context = self.of_seen(self.encoder(observations))
        found = self._velocity(context, noise + time * (end - noise), time)
        weights = counted[:, :, None].expand_as(wanted).flatten(1)
        return ((found - (end - noise)) ** 2 * weights).sum() / weights.sum()

    def _velocity(self, context: Tensor, chunk: Tensor, time: Tensor) -> Tensor:
        """(B, horizon n) change of the chunk in a unit of time."""
        hidden = context + self.of_chunk(chunk) + self.of_time(time.to(chunk))
        velocity: Tensor = self.body(F.relu(hidden))
        return velocity
