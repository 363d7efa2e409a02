"""``python -m pushplan.training.ice_evaluation``: predictors against held-out rollouts.

Every predictor sees the same passages; what the simulator made of them is the truth. Writes a
table in Markdown.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import binary_dilation

from pushplan.interaction import QuasiStatic
from pushplan.interaction.ice_interaction import IceInteraction
from pushplan.interaction.network import IceNetwork
from pushplan.interaction.occupancy import (
    ICE_FRICTION,
    InteractionOccupancy,
    NoMotion,
    OccupancyForecast,
    OccupancyPredictor,
    PassageBatch,
)
from pushplan.training.ice_passages import PassageConfig, voyage_passages
from pushplan.world.checks import integer

AROUND = 5
"""Cells about the swath that belong to its window: half a hull length."""


@dataclass(frozen=True)
class PredictionScores:
    """Errors of one predictor over some passages."""

    passages: int  # number of passages
    patch_mse: float  # mean squared error of the covered fraction over the whole patch
    swath_mse: float  # over the cells within half a hull length of the swath
    work_bias: float  # mean predicted over mean true work; NaN where no work was done
    work_error: float  # mean absolute error of the work over its mean
    work_correlation: float  # Pearson's, NaN where one of them is constant
    milliseconds: float  # median time for a passage


def score(
    batches: Sequence[tuple[PassageBatch, OccupancyForecast]], predictor: OccupancyPredictor
) -> PredictionScores:
    """Score a predictor on batches with their truth."""
    predictor.predict(batches[0][0])  # loads and compiles
    columns = []
    times = []
    around = np.ones((1, 2 * AROUND + 1, 2 * AROUND + 1), dtype=bool)
    for batch, truth in batches:
        began = time.perf_counter()
        found = predictor.predict(batch)
        times.append((time.perf_counter() - began) / len(batch))
        error = (found.after - truth.after).astype(np.float64) ** 2
        window = binary_dilation(batch.patches[:, 2] > 0.0, around)  # (B, 40, 40)
        near = (error * window).sum(axis=(1, 2)) / window.sum(axis=(1, 2))
        columns.append((error.mean(axis=(1, 2)), near, found.work, truth.work))
    patch, swath, work, true = map(np.concatenate, zip(*columns, strict=True))
    mean = float(true.mean()) or float("nan")
    with np.errstate(invalid="ignore"):  # NaN where one of them is constant
        correlation = float(np.corrcoef(work, true)[0, 1])
    return PredictionScores(
        passages=len(true),
        patch_mse=float(patch.mean()),
        swath_mse=float(swath.mean()),
        work_bias=float(work.mean()) / mean,
        work_error=float(np.abs(work - true).mean()) / mean,
        work_correlation=correlation,
        milliseconds=1e3 * float(np.median(times)),
    )


def held_out(
    concentration: float, voyages: int, config: PassageConfig | None = None
) -> list[tuple[PassageBatch, OccupancyForecast]]:
    """Passages through ice of one concentration that no network was trained on, a field each."""
    integer("voyages", voyages, low=1)
    fixed = replace(
        config or PassageConfig(),
        least_concentration=concentration,
        greatest_concentration=concentration,
    )
    first = round(1e4 * concentration)
    return [voyage_passages(first + i, "held-out", fixed) for i in range(voyages)]


def predictors(network: str | None = None) -> dict[str, OccupancyPredictor]:
    """The predictors that are compared, by what the table calls them."""
    return {
        "no motion": NoMotion(),
        "quasi-static": InteractionOccupancy(QuasiStatic(friction=ICE_FRICTION)),
        "ice contacts": InteractionOccupancy(IceInteraction()),
        "network": IceNetwork(network),
    }


def table(rows: Mapping[tuple[float, str], PredictionScores]) -> str:
    """Markdown, one row for each concentration and predictor."""
    lines = [
        "| ice | predictor | MSE patch | MSE swath | work / true | work error | correlation "
        "| ms a passage |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for (ice, name), s in rows.items():
        lines.append(
            f"| {100 * ice:.0f} % | {name} | {_in(1e3 * s.patch_mse)} | {_in(1e3 * s.swath_mse)} "
            f"| {s.work_bias:.2f} | {100 * s.work_error:.0f} % | {_in(s.work_correlation)} "
            f"| {s.milliseconds:.2g} |"
        )
    return "\n".join(lines) + "\n\nMSE in thousandths.\n"


def _in(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.2f}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the table."""
    parser = argparse.ArgumentParser(
        prog="python -m pushplan.training.ice_evaluation", description=__doc__
    )
    parser.add_argument("--network", metavar="FILE.onnx", help="instead of the shipped one")
    parser.add_argument("--voyages", type=int, default=6, help="for each concentration (default 6)")
    options = parser.parse_args(arguments)
    rows = {}
    for fraction in (0.1, 0.2, 0.3, 0.4, 0.5):
        batches = held_out(fraction, options.voyages)
        for name, predictor in predictors(options.network).items():
            rows[fraction, name] = score(batches, predictor)
    sys.stdout.write(table(rows))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
