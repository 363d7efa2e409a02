"""Rearrangement planning: candidate pushes, their graph, and policies that carry them out."""

from pushplan.planners.rearrangement.gtsp_mpc import GtspMpc
from pushplan.planners.rearrangement.gtsp_policy import Gtsp
from pushplan.planners.rearrangement.push import Push, PushCost
from pushplan.planners.rearrangement.push_graph import PushGraph, build_push_graph
from pushplan.planners.rearrangement.push_order import push_order
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig

__all__ = [
    "Gtsp",
    "GtspMpc",
    "Push",
    "PushCost",
    "PushGraph",
    "PushScene",
    "RearrangementConfig",
    "build_push_graph",
    "push_order",
]
