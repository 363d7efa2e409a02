"""Shapes, obstacles and distances around them."""

import enum
from typing import Annotated, overload

import numpy
from numpy.typing import NDArray


def convex_penetration(a: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], b: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)]) -> tuple[float, float, float]: ...

def convex_overlap(a: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], b: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)]) -> bool: ...

def convex_distance(a: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], b: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)]) -> float: ...

def merge_pieces(vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], budget: float) -> Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C')]:
    """
    Merges some convex pieces, of which this returns the number of the convex part of each, so that the areas of the hulls beyond those of the pieces add up to at most a budget [m^2].
    """

def polygon_area(polygon: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)]) -> float: ...

def polygon_centroid(polygon: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)]) -> tuple[float, float]: ...

def polygon_inertia(polygon: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)]) -> float: ...

def transform_points(pose: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], points: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], out: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu')]) -> None: ...

def transform_outlines(poses: Annotated[NDArray[numpy.float64], dict(shape=(None, 3), order='C', device='cpu', writable=False)], vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], out: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu')]) -> None: ...

def arc_step(pose: Annotated[NDArray[numpy.float64], dict(shape=(3), order='C', device='cpu', writable=False)], distance: float, turn: float) -> tuple[float, float, float]: ...

@overload
def fill_convex(image: Annotated[NDArray[numpy.uint8], dict(shape=(None, None), order='C', device='cpu')], vertices_px: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], value: int) -> None: ...

@overload
def fill_convex(image: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu')], vertices_px: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], value: float) -> None: ...

@overload
def fill_convex(image: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], vertices_px: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], value: float) -> None: ...

@overload
def fill_convex(image: Annotated[NDArray[numpy.bool_], dict(shape=(None, None), order='C', device='cpu')], vertices_px: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], value: bool) -> None: ...

@overload
def fill_convex(image: Annotated[NDArray[numpy.int32], dict(shape=(None, None), order='C', device='cpu')], vertices_px: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], value: int) -> None: ...

@overload
def fill_convex(image: Annotated[NDArray[numpy.int64], dict(shape=(None, None), order='C', device='cpu')], vertices_px: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], value: int) -> None: ...

class Obstacles:
    """Convex cores, each with a radius around it."""

    def __init__(self, vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], radii: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], boxes: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> None: ...

    @property
    def vertices(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), writable=False)]:
        """
        (V, 2) corners of the cores [m], each counter-clockwise; a segment has two.
        """

    @property
    def offsets(self) -> Annotated[NDArray[numpy.int64], dict(shape=(None,), writable=False)]:
        """(C + 1,) where each core starts."""

    @property
    def radii(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,), writable=False)]:
        """(C,) how far each obstacle reaches beyond its core [m]."""

    @property
    def boxes(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), writable=False)]:
        """(C, 4) x_min, y_min, x_max, y_max of each obstacle [m]."""

    def distance(self, x: float, y: float) -> float: ...

    def line_of_sight(self, px: float, py: float, qx: float, qy: float, margin: float) -> bool: ...

    def free_points(self, points: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], box: Annotated[NDArray[numpy.float64], dict(shape=(4), order='C', device='cpu', writable=False)], gap: float) -> Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C')]:
        """
        Flags of points that lie in the box (4,) and the gap or more off every obstacle.
        """

    def fill_clearance(self, out: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], first: int, last: int, origin: Annotated[NDArray[numpy.float64], dict(shape=(2), order='C', device='cpu', writable=False)], step: float) -> None: ...

def core_distance(x: float, y: float, core: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)]) -> float: ...

class Regions:
    """A union of discs, half-planes and convex polygons."""

    def __init__(self, discs: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], half_planes: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

    @property
    def discs(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), writable=False)]:
        """(D, 3) x, y, radius [m]; a radius of 0 is a point."""

    @property
    def half_planes(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), writable=False)]:
        """
        (H, 4) point x, y [m] and unit normal; what is on or beyond the line belongs to it.
        """

    @property
    def vertices(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), writable=False)]:
        """
        (V, 2) corners of convex polygons [m], counter-clockwise; two make a segment.
        """

    @property
    def offsets(self) -> Annotated[NDArray[numpy.int64], dict(shape=(None,), writable=False)]:
        """(P + 1,) where each polygon starts."""

    def nearest(self, k: int, x: float, y: float) -> tuple[float, float]: ...

class Bends:
    """Places where a shortest path may bend."""

    def __init__(self, points: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], incoming: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], outgoing: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)]) -> None: ...

class Nodes:
    """Bends and ends of paths, sorted by distance to the goal."""

    def __init__(self, bends: Bends, distances: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

class GoalScene:
    """A goal among obstacles."""

    def __init__(self, regions: Regions, obstacles: Obstacles, box: Annotated[NDArray[numpy.float64], dict(shape=(4), order='C', device='cpu', writable=False)], gap: float) -> None: ...

    def goal_leg(self, x: float, y: float) -> tuple[float, float, float]: ...

    def goal_legs(self, points: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C')]:
        """(N, 3) `goal_leg` of each point."""

    def node_leg(self, x: float, y: float, limit: float, hint: int, tangent_only: bool, nodes: Nodes) -> tuple[float, int]: ...

    def fill_distances(self, out: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], origin: Annotated[NDArray[numpy.float64], dict(shape=(2), order='C', device='cpu', writable=False)], step: float, nodes: Nodes, sliver: float) -> None: ...

def visible_pairs(bends: Bends, obstacles: Obstacles, gap: float) -> tuple[Annotated[NDArray[numpy.int64], dict(shape=(None, 2))], Annotated[NDArray[numpy.float64], dict(shape=(None,))]]: ...

def relax(starts: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], ends: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], lengths: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], distances: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], parents: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu')]) -> None: ...

def segment_crossings(first: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], second: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, 2))]: ...

def find_nearest_marked(marked: Annotated[NDArray[numpy.bool_], dict(shape=(None, None), order='C', device='cpu', writable=False)], rows: Annotated[NDArray[numpy.int64], dict(shape=(None, None), order='C', device='cpu')], cols: Annotated[NDArray[numpy.int64], dict(shape=(None, None), order='C', device='cpu')]) -> None: ...

def sample(values: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], ox: float, oy: float, step: float, x: float, y: float) -> float: ...

def sample_points(values: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], ox: float, oy: float, step: float, points: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], out: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')]) -> None: ...

class ObstacleGrid:
    """The obstacles that reach into each cell."""

    def __init__(self, obstacles: Obstacles, margin: float) -> None: ...

    @property
    def shape(self) -> tuple[int, int]: ...

    @property
    def cell(self) -> float: ...

    @property
    def first(self) -> Annotated[NDArray[numpy.int64], dict(shape=(None,))]: ...

    @property
    def items(self) -> Annotated[NDArray[numpy.int64], dict(shape=(None,))]: ...

class Corners:
    """Corners by obstacle, then ends on the goal's rim."""

    def __init__(self, points: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], incoming: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], outgoing: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], owner: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], first: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], middles: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], halves: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)]) -> None: ...

class CoveredSides:
    """Cells over a map, and which sides between them are covered."""

    def __init__(self, corners: Corners, box: Annotated[NDArray[numpy.float64], dict(shape=(4), order='C', device='cpu', writable=False)], cell: float) -> None: ...

    @property
    def shape(self) -> tuple[int, int]: ...

    @property
    def cell(self) -> float: ...

class GoalEstimate:
    """Estimates of the way to a goal."""

    def __init__(self, cells: CoveredSides, scene: GoalScene, start: Annotated[NDArray[numpy.float64], dict(shape=(2), order='C', device='cpu', writable=False)]) -> None: ...

    def run(self, cells: int) -> bool: ...

    def at(self, x: float, y: float) -> float: ...

class SearchOutcome(enum.Enum):
    FOUND = 0

    EXHAUSTED = 1

    PAUSED = 2

class VisibilitySearch:
    """Lazy A* over the visibility graph."""

    def __init__(self, start: Annotated[NDArray[numpy.float64], dict(shape=(2), order='C', device='cpu', writable=False)], corners: Corners, scene: GoalScene, grid: ObstacleGrid, sliver: float, estimate: GoalEstimate | None = None) -> None: ...

    def run(self, budget: int) -> SearchOutcome: ...

    def path(self) -> Annotated[NDArray[numpy.int64], dict(shape=(None,))]: ...

def fill_shadows(mask: Annotated[NDArray[numpy.uint8], dict(shape=(None, None), order='C', device='cpu')], x: float, y: float, corners: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], value: int) -> None: ...

def fill_bend_distances(table: Annotated[NDArray[numpy.float32], dict(shape=(None, None, None), order='C', device='cpu')], origin: Annotated[NDArray[numpy.float64], dict(shape=(2), order='C', device='cpu', writable=False)], step: float, bends: Bends, between: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], corners: Annotated[NDArray[numpy.float64], dict(shape=(None, 2), order='C', device='cpu', writable=False)], offsets: Annotated[NDArray[numpy.int64], dict(shape=(None,), order='C', device='cpu', writable=False)], gap: float) -> None: ...

def bends_in_sight(x: float, y: float, bends: Bends, obstacles: Obstacles, gap: float, sliver: float) -> tuple[Annotated[NDArray[numpy.int64], dict(shape=(None,))], Annotated[NDArray[numpy.float64], dict(shape=(None,))]]: ...
