"""Sub-tasks of manipulation: candidate pushes, their graph, and policies that carry them out."""

from pushplan.planners.subtasks.config import SubTaskConfig
from pushplan.planners.subtasks.graph import SubTaskGraph, build_graph
from pushplan.planners.subtasks.policy import GtspMpc
from pushplan.planners.subtasks.published import Gtsp
from pushplan.planners.subtasks.push import Push
from pushplan.planners.subtasks.scene import Scene
from pushplan.planners.subtasks.tours import tour_of

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
