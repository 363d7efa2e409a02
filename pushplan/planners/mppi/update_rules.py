"""Updates of the distribution of controls from samples and their costs."""

from __future__ import annotations

import math

import numpy as np

from pushplan.planners.mppi.mppi_config import MppiConfig
from pushplan.world.checks import FloatArray


def exponential_weights(costs: FloatArray, temperature: float) -> FloatArray:
    """Weights proportional to exp(-(J - min J) / λ), as path integral control has them.

    λ is ``temperature`` times (lower quartile of J - min J): Williams et al. (ICRA 2017, eq. 17)
    take it in units of the cost, which would have to be chosen for every task anew. The quartile,
    not the median, as up to half of the samples may run into walls, and cost far more.

    Args:
        costs: (S,) J of each sample.
        temperature: positive.

    Returns:
        (S,) weights, with sum 1.
    """
    above = costs - costs.min()
    scale = temperature * float(np.quantile(above, 0.25))
    if scale <= 0.0:  # a quarter of the samples are as good as the best
        weights = (above == 0.0).astype(np.float64)
    else:
        weights = np.exp(-above / scale)
    normal: FloatArray = weights / weights.sum()
    return normal


def elite_weights(costs: FloatArray, fraction: float) -> FloatArray:
    """Equal weights of the best samples, as the cross-entropy method has them.

    Rubinstein and Kroese, "The Cross-Entropy Method", 2004, algorithm 4.2.1.

    Args:
        costs: (S,) J of each sample.
        fraction: of the samples that are kept, one at least.

    Returns:
        (S,) weights, with sum 1.
    """
    count = max(1, math.ceil(fraction * len(costs)))
    weights = np.zeros(len(costs))
    weights[np.argsort(costs, kind="stable")[:count]] = 1.0 / count
    return weights


def updated(
    config: MppiConfig, samples: FloatArray, costs: FloatArray, spread: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The next mean and standard deviation of the controls at the knots.

    Args:
        config: names the rule.
        samples: (S, M, 2) controls at the knots.
        costs: (S,) their costs.
        spread: (M, 2) the standard deviation that they were drawn with.

    Returns:
        (M, 2) mean, (M, 2) standard deviation; path integral control leaves the latter as it is.
    """
    if config.update == "mppi":
        weights = exponential_weights(costs, config.temperature)
        return np.tensordot(weights, samples, 1), spread
    weights = elite_weights(costs, config.elite)
    mean = np.tensordot(weights, samples, 1)
    return mean, np.sqrt(np.tensordot(weights, (samples - mean) ** 2, 1))
