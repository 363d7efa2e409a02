"""Success, efficiency and effort of manipulation: the Bench-Push paper, equations 3 to 5."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pushplan.geometry import VisibilityGraph, object_ways
from pushplan.geometry.object_ways import shared_ways
from pushplan.metrics.lengths import interaction_work, object_path_lengths, robot_path_length
from pushplan.world import (
    AreaGoal,
    Episode,
    GoalDisc,
    ManipulationGoal,
    ObjectGoals,
    Receptacle,
    StaticMap,
    World,
)
from pushplan.world.checks import BoolArray, FloatArray
from pushplan.world.outline import centroid

EDGE_PLACES = 10
"""Places on every edge of a clearance area that the original's code takes for the goal."""


@dataclass(frozen=True)
class ManipulationScores:
    """Scores of a robot that brings objects to where they belong.

    Args:
        success: S_manip in [0, 1]: the fraction of the objects with a sub-task whose sub-task was
            completed.
        efficiency: E_manip: L*(O') over driven length. The tree is no strict lower bound, so it
            can pass 1; 0 if nothing was completed.
        effort: I_manip in [0, 1]: the least work for what was completed over all work.
        completed: K', number of completed sub-tasks.
        path_length_m: l_0, length of the robot's path [m].
        interaction_work_kg_m: sum of object mass times object path length [kg m].
        tree_length_m: L*(O'), length of the minimum spanning tree [m].
    """

    success: float
    efficiency: float
    effort: float
    completed: int
    path_length_m: float
    interaction_work_kg_m: float
    tree_length_m: float


def manipulation_scores(episode: Episode, *, reference: bool = False) -> ManipulationScores:
    """Score one episode that has a goal for the objects.

    ``episode.completed`` says which sub-tasks were done. Lengths are those of a point: neither
    the robot nor an object is widened.

    - An object whose sub-task was done at the start needs no path and no work: it counts in
      S_manip, and its l_i* is 0, but it is no vertex of the tree.
    - Without any objects there is nothing to do: S_manip is 1.
    - A robot that never moved has E_manip = 1 if what was completed was so at the start and there
      is nothing else, else 0.
    - No work at all gives I_manip = 1.

    Args:
        episode: the recorded run.
        reference: measure as the original's code does: straight lines instead of shortest paths
            around static things, to the centre of a receptacle instead of its rim, and to the
            nearest of ten places along every edge of a clearance area, open or not; effort can
            then pass 1.

    Raises:
        InvalidInputError: if the goal is one for the robot.
    """
    done = _completed(episode)
    fraction = s_manip(episode)
    needed = done & ~episode.world.completed  # what was done at the start needs no path
    shortest = shortest_lengths(episode.world, needed, reference=reference)
    tree = tree_length(episode.world, needed, reference=reference)
    driven = robot_path_length(episode)
    work = interaction_work(episode)
    return ManipulationScores(
        success=fraction,
        efficiency=efficiency(tree, driven, everything=fraction == 1.0),
        effort=effort(
            episode.world, shortest, object_path_lengths(episode), driven, bounded=not reference
        ),
        completed=int(done.sum()),
        path_length_m=driven,
        interaction_work_kg_m=work,
        tree_length_m=tree,
    )


def shortest_lengths(start: World, chosen: BoolArray, *, reference: bool = False) -> FloatArray:
    """(K,) l_i* [m] of the chosen objects, 0 for the others; inf where no way leads to the goal.

    Args:
        start: the scene at the start.
        chosen: (K,) flags.
        reference: as in `manipulation_scores`.
    """
    lengths = np.zeros(len(chosen))
    goal: ManipulationGoal | None = start.manipulation_goal
    if isinstance(goal, ObjectGoals):  # nobody goes to a place that is taken at the start
        goal = goal.left(start.movables.ids, start.movables.poses)
    if goal is None:
        return lengths
    ids = start.movables.ids[chosen]
    places = start.movables.poses[chosen, :2]
    if reference:
        # takes half a second to import, and scores of navigation need neither
        from scipy.spatial.distance import cdist

        lengths[chosen] = shared_ways(
            goal, ids, places, lambda end, points: cdist(points, _reference_ends(end)).min(axis=1)
        )
    else:
        lengths[chosen] = object_ways(start.static, goal, ids, places)
    return lengths


def tree_length(start: World, chosen: BoolArray, *, reference: bool = False) -> float:
    """L*(O') [m] of the chosen objects, 0 if there are none; inf where no way leads.

    The nearest goal points hang on their own objects alone, so their edges are in every spanning
    tree and only the robot and the objects have to be spanned.
    """
    if not chosen.any():
        return 0.0
    points = [start.robot_pose[:2], *start.movables.poses[chosen, :2]]
    tree = spanning_tree_length(None if reference else start.static, points)
    return tree + float(shortest_lengths(start, chosen, reference=reference).sum())


def spanning_tree_length(static: StaticMap | None, points: list[FloatArray]) -> float:
    """Length [m] of the minimum spanning tree over points (2,) [m], inf if one is cut off.

    Edges are shortest paths of a point around what is static, straight lines without a map.
    """
    import networkx as nx  # imported here as scipy is above

    paths = None
    if static is not None and not static.is_empty:
        paths = VisibilityGraph(static, exact=True)
    graph: nx.Graph[int] = nx.empty_graph(len(points))
    for k, a in enumerate(points):
        for j, b in enumerate(points[:k]):
            length = math.dist(a, b)
            if paths is not None:
                length = paths.shortest_path(a, b).length
            graph.add_edge(j, k, weight=length)
    tree = nx.minimum_spanning_edges(graph, algorithm="prim")
    return float(sum(edge["weight"] for _, _, edge in tree))


def efficiency(tree_m: float, driven_m: float, *, everything: bool) -> float:
    """E_manip, equation 4.

    NaN if something was completed although no path leads there.

    Args:
        tree_m: L*(O') [m].
        driven_m: l_0 [m].
        everything: all sub-tasks were completed.
    """
    if math.isinf(tree_m):
        return math.nan
    if driven_m > 0.0:
        return tree_m / driven_m
    return 1.0 if everything and tree_m == 0.0 else 0.0


def effort(
    world: World,
    shortest: FloatArray,
    lengths: FloatArray,
    driven_m: float,
    *,
    bounded: bool = True,
) -> float:
    """I_manip, equation 5.

    An object that got to its goal on a path shorter than l_i* counts with that path. That happens
    where a part of it was in the goal from the start, or where it was pushed over an edge that is
    said to be closed; so I_manip stays in [0, 1].

    Args:
        world: the masses.
        shortest: (K,) l_i* of the completed objects [m], 0 for the others.
        lengths: (K,) l_i [m].
        driven_m: l_0 [m].
        bounded: do so; the original's code does not.
    """
    masses = world.movables.masses
    work = float(masses @ lengths)
    if work == 0.0:
        return 1.0
    own = world.robot.mass * driven_m
    needed = float(masses @ (np.minimum(shortest, lengths) if bounded else shortest))
    fraction = (own + needed) / (own + work)
    return min(1.0, fraction) if bounded else fraction  # rounding may pass 1


def _completed(episode: Episode) -> BoolArray:
    assert episode.completed is not None  # the episode has filled it in
    return episode.completed


def _reference_ends(goal: AreaGoal | GoalDisc) -> FloatArray:
    """(N, 2) places [m] that the original's code takes for the goal; the middle of a disc."""
    if isinstance(goal, GoalDisc):
        return goal.center[None]
    if isinstance(goal, Receptacle):
        return centroid(goal.polygon)[None]
    fractions = (np.arange(EDGE_PLACES) + 0.5)[:, None, None] / EDGE_PLACES
    edges = np.roll(goal.polygon, -1, axis=0) - goal.polygon
    ends: FloatArray = goal.polygon + fractions * edges
    return ends.reshape(-1, 2)


def place_errors(episode: Episode) -> tuple[FloatArray, FloatArray]:
    """Distances [m] and least turns [rad] at the end of the (N,) objects that have places."""
    goal = episode.world.goal
    if not isinstance(goal, ObjectGoals):
        return np.zeros(0), np.zeros(0)
    poses = episode.object_poses[-1]
    places = goal.assigned(episode.world.movables.ids, poses)
    k = np.flatnonzero(places >= 0)
    distances, turns = goal.errors(poses[k, None])
    chosen = np.arange(len(k)), places[k]
    return distances[chosen], turns[chosen]


def place_error(episode: Episode) -> float | None:
    """Mean distance [m] of the objects from the middles of their places at the end."""
    return _mean(place_errors(episode)[0])


def heading_error(episode: Episode) -> float | None:
    """Mean turn [rad] of the objects from their headings at the end, up to symmetry."""
    return _mean(place_errors(episode)[1])


def _mean(errors: FloatArray) -> float | None:
    return float(errors.mean()) if len(errors) else None


def s_manip(episode: Episode) -> float:
    """S_manip of an episode."""
    done = _completed(episode)
    done = done[episode.world.wanted]
    return float(done.mean()) if len(done) else 1.0


def e_manip(episode: Episode) -> float:
    """E_manip of an episode."""
    return manipulation_scores(episode).efficiency


def e_manip_reference(episode: Episode) -> float:
    """E_manip as the original's code measures it."""
    return manipulation_scores(episode, reference=True).efficiency


def i_manip_reference(episode: Episode) -> float:
    """I_manip as the original's code measures it."""
    return manipulation_scores(episode, reference=True).effort


def i_manip(episode: Episode) -> float:
    """I_manip of an episode; without the spanning tree, which takes longest."""
    needed = _completed(episode) & ~episode.world.completed
    shortest = shortest_lengths(episode.world, needed)
    return effort(episode.world, shortest, object_path_lengths(episode), robot_path_length(episode))
