"""Sub-tasks of manipulation: candidate pushes, their graph, and policies that carry them out."""

from pushplan.planners.rearrangement.graph import SubTaskGraph, build_graph
from pushplan.planners.rearrangement.gtsp import Gtsp
from pushplan.planners.rearrangement.gtsp_mpc import GtspMpc
from pushplan.planners.rearrangement.push import Push
from pushplan.planners.rearrangement.rearrangement_config import SubTaskConfig
from pushplan.planners.rearrangement.scene import Scene
from pushplan.planners.rearrangement.tours import tour_of

__all__ = [
    "Gtsp",
    "GtspMpc",
    "Push",
    "Scene",
    "SubTaskConfig",
    "SubTaskGraph",
    "build_graph",
    "tour_of",
]
