"""Scores of a recorded episode. A metric is a function of an `Episode` and of nothing else."""

from pushplan.metrics.lengths import interaction_work, object_path_lengths
from pushplan.metrics.manipulation import ManipulationScores, manipulation_scores
from pushplan.metrics.navigation import NavigationScores, navigation_scores
from pushplan.metrics.pushes import Pushing, pushing
from pushplan.metrics.registry import METRICS, Metric, Role, compute, metric_function, metric_names
from pushplan.world.polyline import path_length

__all__ = [
    "METRICS",
    "ManipulationScores",
    "Metric",
    "NavigationScores",
    "Pushing",
    "Role",
    "compute",
    "interaction_work",
    "manipulation_scores",
    "metric_function",
    "metric_names",
    "navigation_scores",
    "object_path_lengths",
    "path_length",
    "pushing",
]
