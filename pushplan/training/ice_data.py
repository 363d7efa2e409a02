"""``python -m pushplan.training.ice_data``: pairs of ice before and after a ship, in shards.

A shard is a ``.npz`` file with the passages of a few voyages. Shards that are there already are
kept, so an interrupted run goes on where it stopped; the bytes depend on the seeds alone.
"""

from __future__ import annotations

import argparse
import logging
import multiprocessing
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, fields
from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.files.output_files import replacing
from pushplan.files.safe_files import read_npz
from pushplan.training.ice_passages import SPLITS, voyage_passages
from pushplan.world import InvalidInputError
from pushplan.world.checks import choice, integer

log = logging.getLogger(__name__)

LEVELS = 16
"""Coverage is stored in steps of 1 / 16, which is what it is drawn in."""
VOYAGES_PER_SHARD = 10


@dataclass(frozen=True, eq=False)
class IcePairs:
    """Patches before and after, as the network learns them."""

    patches: NDArray[np.uint8]  # (N, 3, 40, 40) uint8 in sixteenths: occupancy, footprint, swath
    after: NDArray[np.uint8]  # (N, 40, 40) uint8 in sixteenths
    work: NDArray[np.float32]  # (N,) area of each object times its path length, summed, in cells³

    def __len__(self) -> int:
        return len(self.work)


_NAMES = tuple(field.name for field in fields(IcePairs))


def voyage_pairs(seed: int, split: str) -> IcePairs:
    """The pairs of one voyage."""
    batch, truth = voyage_passages(seed, split)
    return IcePairs(
        np.rint(LEVELS * batch.patches).astype(np.uint8),
        np.rint(LEVELS * truth.after).astype(np.uint8),
        (truth.work / (batch.density * batch.cell**3)).astype(np.float32),
    )


def _joined(pairs: Sequence[IcePairs]) -> IcePairs:
    columns = zip(*(vars(one).values() for one in pairs), strict=True)
    return IcePairs(*map(np.concatenate, columns))


def write_shard(folder: str | Path, split: str, index: int) -> Path:
    """Simulate the voyages of one shard and write it, unless it is there."""
    path = Path(folder) / f"{split}-{index:05d}.npz"
    if path.exists():
        return path
    seeds = range(index * VOYAGES_PER_SHARD, (index + 1) * VOYAGES_PER_SHARD)
    pairs = _joined([voyage_pairs(seed, split) for seed in seeds])
    with replacing(path) as file:
        np.savez_compressed(file, **vars(pairs))
    return path


def write_shards(folder: str | Path, *, split: str, shards: int, workers: int = 1) -> list[Path]:
    """Write the first shards of a split, in several processes.

    Args:
        folder: made if it is not there.
        split: ``"train"`` or ``"held-out"``.
        shards: how many; each holds 480 pairs.
        workers: processes.
    """
    choice("split", split, SPLITS)
    integer("shards", shards, low=1)
    integer("workers", workers, low=1)
    Path(folder).mkdir(parents=True, exist_ok=True)
    paths = []
    with ExitStack() as stack:
        run: Any = map
        if workers > 1:
            context = multiprocessing.get_context("spawn")
            run = stack.enter_context(ProcessPoolExecutor(workers, mp_context=context)).map
        for path in run(write_shard, repeat(folder), repeat(split), range(shards)):
            paths.append(path)
            log.info("%s: shard %d of %d", split, len(paths), shards)
    return paths


def read_shards(folder: str | Path, split: str, limit: int | None = None) -> IcePairs:
    """All pairs of a split, in the order of their shards.

    Raises:
        InvalidInputError: if there are none, or a file is not a shard.
    """
    choice("split", split, SPLITS)
    paths = sorted(Path(folder).glob(f"{split}-*.npz"))[:limit]
    if not paths:
        raise InvalidInputError(
            f"no shards {split}-*.npz in {folder}: make them with "
            f"'python -m pushplan.training.ice_data --out {folder} --split {split}'"
        )
    return _joined([_read(path) for path in paths])


def _read(path: Path) -> IcePairs:
    pairs = IcePairs(**read_npz(path, "shard of ice passages", _NAMES))
    count = len(pairs.work)
    if pairs.patches.shape[:2] != (count, 3) or pairs.after.shape[0] != count:
        raise InvalidInputError(f"{path} is not a shard of ice passages: shapes disagree")
    return pairs


def main(arguments: Sequence[str] | None = None) -> int:
    """Write shards of both splits, or of one."""
    parser = argparse.ArgumentParser(
        prog="python -m pushplan.training.ice_data", description=__doc__
    )
    parser.add_argument("--out", required=True, metavar="DIR", help="folder of the shards")
    parser.add_argument("--split", choices=SPLITS, help="only this one (default: both)")
    parser.add_argument("--shards", type=int, default=60, help="of the training split (default 60)")
    parser.add_argument("--held-out", type=int, default=6, help="held-out shards (default 6)")
    parser.add_argument("--workers", type=int, default=1, help="processes (default 1)")
    options = parser.parse_args(arguments)
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    counts = {"train": options.shards, "held-out": options.held_out}
    for split in SPLITS if options.split is None else (options.split,):
        write_shards(options.out, split=split, shards=counts[split], workers=options.workers)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
