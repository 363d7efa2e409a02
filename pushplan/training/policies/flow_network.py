"""A flow from noise to a chunk of actions, in PyTorch. Import it only where PyTorch is there."""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from pushplan.training.policies.networks import Encoder, layers


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
