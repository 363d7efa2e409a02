"""Generalized travelling salesman problem: the order of clusters, and a node of each."""

from pushplan.gtsp.gtsp_config import GtspConfig
from pushplan.gtsp.gtsplib import read_gtsp, read_tour, write_gtsp, write_tour
from pushplan.gtsp.instance import GtspInstance
from pushplan.gtsp.solve import solve_gtsp
from pushplan.gtsp.tour import Tour, TourStats, TourStatus

__all__ = [
    "GtspConfig",
    "GtspInstance",
    "Tour",
    "TourStats",
    "TourStatus",
    "read_gtsp",
    "read_tour",
    "solve_gtsp",
    "write_gtsp",
    "write_tour",
]
