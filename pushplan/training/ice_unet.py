"""The network that predicts ice occupancy, in PyTorch. Import it only where PyTorch is there."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional as F
from torch.nn.utils.fusion import fuse_conv_bn_eval

from pushplan.interaction.occupancy import CHANNELS

WIDTHS = (32, 48, 64)
"""Channels of `IceUNet` at a half, a quarter and an eighth of the patch's resolution."""


def _block(inputs: int, outputs: int, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, 3, stride=stride, padding=1, bias=False),
        nn.BatchNorm2d(outputs),
        nn.ReLU(inplace=True),
    )


class IceUNet(nn.Module):
    """A small U-Net (Ronneberger, Fischer and Brox 2015, arXiv 1505.04597) from patch to patch.

    Cells are folded 2 x 2 into channels, so that no layer runs at full resolution; skips are added
    instead of concatenated. It learns the change of occupancy, from an output of zero on. A second
    head gives the work on the ice done at each place, whose sum is the forecast's work.
    """

    def __init__(self) -> None:
        super().__init__()
        a, b, c = WIDTHS
        self.top = nn.Sequential(_block(4 * len(CHANNELS), a), _block(a, a))
        self.middle = nn.Sequential(_block(a, b, stride=2), _block(b, b))
        self.bottom = nn.Sequential(_block(b, c, stride=2), _block(c, c), _block(c, c))
        self.rise = nn.Conv2d(c, b, 1)
        self.middle_up = _block(b, b)
        self.rise_more = nn.Conv2d(b, a, 1)
        self.top_up = _block(a, a)
        self.change = nn.Conv2d(a, 4, 3, padding=1)
        self.effort = nn.Conv2d(a, 1, 3, padding=1)
        with torch.no_grad():
            for parameter in self.change.parameters():
                parameter.zero_()
            for parameter in list(self.effort.parameters())[1:]:  # the bias: hardly any work
                parameter.fill_(-7.0)

    def forward(self, patches: Tensor) -> tuple[Tensor, Tensor]:
        """Predict a batch.

        Args:
            patches: (B, 3, 40, 40) fractions: occupancy, footprint, swath.

        Returns:
            (B, 40, 40) occupancy after, not cut to [0, 1]; (B,) work on ice of unit density, in
            units of hull length cubed.
        """
        high = self.top(F.pixel_unshuffle(patches, 2))
        low = self.middle(high)
        up = F.interpolate(self.rise(self.bottom(low)), scale_factor=2.0, mode="nearest")
        low = self.middle_up(low + up)
        up = F.interpolate(self.rise_more(low), scale_factor=2.0, mode="nearest")
        high = self.top_up(high + up)
        after = patches[:, 0] + F.pixel_shuffle(self.change(high), 2)[:, 0]
        return after, F.softplus(self.effort(high)).sum(dim=(1, 2, 3))


class ExportedIceUNet(nn.Module):
    """`IceUNet` as it is shipped: normalisation folded into weights, occupancy cut to [0, 1]."""

    def __init__(self, network: IceUNet) -> None:
        super().__init__()
        self.network = network.eval()
        for block in [m for m in network.modules() if isinstance(m, nn.Sequential)]:
            layers = list(block.children())
            if isinstance(layers[0], nn.Conv2d) and isinstance(layers[1], nn.BatchNorm2d):
                block[0] = fuse_conv_bn_eval(layers[0], layers[1])
                block[1] = nn.Identity()

    def forward(self, patches: Tensor) -> tuple[Tensor, Tensor]:
        """As `IceUNet.forward`."""
        after, work = self.network.forward(patches)
        return after.clamp(0.0, 1.0), work
