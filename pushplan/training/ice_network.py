"""``python -m pushplan.training.ice_network``: train the ice network and export it to ONNX.

Needs the extra ``learn`` (PyTorch). The same shards, seed, thread count and version of PyTorch
give the same weights.
"""

from __future__ import annotations

import argparse
import json
import logging
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pushplan.imports.on_demand import need
from pushplan.interaction.occupancy import CELLS_PER_LENGTH, CHANNELS, PATCH_CELLS
from pushplan.training.ice_data import LEVELS, IcePairs, read_shards
from pushplan.training.libraries import parameter_count, write_onnx
from pushplan.world.checked_fields import (
    CheckedFields,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
)

if TYPE_CHECKING:
    from pushplan.training.ice_unet import IceUNet

log = logging.getLogger(__name__)

_MAP_WEIGHT = 20.0
"""Weight of the mean squared error of the occupancy against the Poisson deviance of the work.

That is unbiased in the mean and allows more error where the work is more."""


@dataclass(frozen=True)
class IceTrainingConfig(CheckedFields):
    """Parameters of the training."""

    epochs: PositiveInt = 12  # passes over the pairs
    batch: PositiveInt = 64  # pairs in a step
    # greatest learning rate of AdamW; it rises over the first tenth of the steps and falls to
    # nothing along a cosine (one-cycle schedule)
    rate: PositiveFloat = 4e-3
    decay: NonNegativeFloat = 1e-4  # of the weights
    seed: NonNegativeInt = 0  # of initial weights, order and mirroring
    threads: PositiveInt = 1  # of PyTorch; the result depends on it in the last digits


def train(pairs: IcePairs, config: IceTrainingConfig | None = None) -> tuple[IceUNet, list[float]]:
    """Train a network from scratch.

    Returns:
        The network, and the mean loss of each epoch.

    Raises:
        MissingDependencyError: without PyTorch.
    """
    torch = need("torch")
    from pushplan.training.ice_unet import IceUNet

    config = config or IceTrainingConfig()
    torch.set_num_threads(config.threads)
    torch.manual_seed(config.seed)  # initialises the weights
    generator = torch.Generator().manual_seed(config.seed)
    network: Any = IceUNet()
    network = network.to(memory_format=torch.channels_last)
    log.info("%d parameters, %d pairs", parameter_count(network), len(pairs))
    optimizer = torch.optim.AdamW(network.parameters(), lr=config.rate, weight_decay=config.decay)
    steps = max(1, len(pairs) // config.batch)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimizer, max_lr=config.rate, total_steps=config.epochs * steps + 1, pct_start=0.1
    )
    data = tuple(torch.from_numpy(x) for x in (pairs.patches, pairs.after, pairs.work))
    losses = []
    network.train()
    for epoch in range(config.epochs):
        began = time.perf_counter()
        total = 0.0
        order = torch.randperm(len(pairs), generator=generator)
        for step in range(steps):
            chosen = order[step * config.batch : (step + 1) * config.batch]
            mirrored = bool(torch.rand((), generator=generator) < 0.5)
            loss = _loss(network, [x[chosen] for x in data], mirrored)
            optimizer.zero_grad(set_to_none=True)
            loss.backward()
            torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimizer.step()
            schedule.step()
            total += float(loss.detach())
        losses.append(total / steps)
        seconds = time.perf_counter() - began
        log.info("epoch %d of %d: loss %.4f, %.0f s", epoch + 1, config.epochs, losses[-1], seconds)
    return network, losses


def _loss(network: IceUNet, chosen: list[Any], mirrored: bool) -> Any:
    """Error of a step: occupancy and work, of patches seen in a mirror or not."""
    patches = chosen[0].float() / LEVELS
    after = chosen[1].float() / LEVELS
    work = chosen[2] / CELLS_PER_LENGTH**3
    if mirrored:
        patches = patches.flip(-1)
        after = after.flip(-1)
    found, effort = network(patches)
    occupancy = ((found - after) ** 2).mean()
    return _MAP_WEIGHT * occupancy + (effort - work * (effort + 1e-6).log()).mean()


def export(network: IceUNet, path: str | Path) -> None:
    """Write a network as ONNX for any batch size; PyTorch is not needed to run it."""
    torch = need("torch")
    from pushplan.training.ice_unet import ExportedIceUNet

    example = torch.zeros(2, len(CHANNELS), PATCH_CELLS, PATCH_CELLS)
    write_onnx(ExportedIceUNet(network), example, path, ("patches", "after", "work"))


def main(arguments: Sequence[str] | None = None) -> int:
    """Train on a folder of shards and write the network and a record of the training."""
    parser = argparse.ArgumentParser(
        prog="python -m pushplan.training.ice_network", description=__doc__
    )
    default = IceTrainingConfig()
    parser.add_argument("--data", required=True, metavar="DIR", help="shards of ice_data")
    parser.add_argument("--out", required=True, metavar="FILE.onnx", help="the network")
    for name in ("epochs", "seed", "threads"):
        parser.add_argument(f"--{name}", type=int, default=getattr(default, name))
    parser.add_argument("--shards", type=int, default=None, help="use only so many")
    options = parser.parse_args(arguments)
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    config = IceTrainingConfig(epochs=options.epochs, seed=options.seed, threads=options.threads)
    pairs = read_shards(options.data, "train", options.shards)
    began = time.perf_counter()
    network, losses = train(pairs, config)
    seconds = time.perf_counter() - began
    export(network, options.out)
    record = {
        "pairs": len(pairs),
        "seconds": round(seconds),
        "losses": [round(loss, 5) for loss in losses],
        "config": asdict(config),
    }
    Path(options.out).with_suffix(".json").write_text(json.dumps(record, indent=2) + "\n")
    log.info("wrote %s after %.0f s", options.out, seconds)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
