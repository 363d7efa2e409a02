"""Which cluster next, and which of its nodes: the generalized travelling salesman problem."""

from pushplan.planners.sequencing.config import GtspConfig
from pushplan.planners.sequencing.gtsplib import read_gtsp
from pushplan.planners.sequencing.gtsplib_write import read_tour, write_gtsp, write_tour
from pushplan.planners.sequencing.instance import GtspInstance
from pushplan.planners.sequencing.solve import solve_gtsp
from pushplan.planners.sequencing.tour import Tour, TourStats, TourStatus
from pushplan.planners.sequencing.warming import warm_up_solver

__all__ = [
    "GtspConfig",
    "GtspInstance",
    "Tour",
    "TourStats",
    "TourStatus",
    "read_gtsp",
    "read_tour",
    "solve_gtsp",
    "warm_up_solver",
    "write_gtsp",
    "write_tour",
]
