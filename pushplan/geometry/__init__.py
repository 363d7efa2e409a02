"""Polygons, rasters, grids, shortest paths and distance fields."""

from pushplan.geometry.convex import convex_distance, convex_overlap, convex_penetration
from pushplan.geometry.distance_field import GeodesicField, geodesic_field, sample_values
from pushplan.geometry.grid import Grid, clearance_field, occupancy
from pushplan.geometry.object_ways import object_ways
from pushplan.geometry.obstacles import core_distance
from pushplan.geometry.polygon import (
    gyration_squares,
    polygon_area,
    polygon_centroid,
    polygon_inertia,
)
from pushplan.geometry.raster import fill_convex
from pushplan.geometry.shortest_path import GoalDistances, Path, VisibilityGraph, goal_distances
from pushplan.geometry.transforms import transform_outlines, transform_points

__all__ = [
    "GeodesicField",
    "GoalDistances",
    "Grid",
    "Path",
    "VisibilityGraph",
    "clearance_field",
    "convex_distance",
    "convex_overlap",
    "convex_penetration",
    "core_distance",
    "fill_convex",
    "geodesic_field",
    "goal_distances",
    "gyration_squares",
    "object_ways",
    "occupancy",
    "polygon_area",
    "polygon_centroid",
    "polygon_inertia",
    "sample_values",
    "transform_outlines",
    "transform_points",
]
