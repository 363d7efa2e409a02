"""Ship policies: the lattice planner, a path follower, and plans renewed while it drives."""

from __future__ import annotations

from pushplan.interaction.path_sweepers import default_interaction
from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.following.replanning import Replanning
from pushplan.planners.ship_lattice.ship_lattice import ShipLattice, published, quick
from pushplan.world import Planner, Stop

RENEWAL = 2.0
"""A new plan is made when the robot has gone this far [R]."""
MARGIN = 0.05
"""It is followed if it is cheaper than the rest of the old one by this much travel [R]."""


def ship_lattice(planner: Planner | None = None, stop: Stop | None = None) -> PlanFollower:
    """The ship lattice with plans renewed while it drives, compared by their predicted cost."""
    rule = Replanning(surprise=1e9, margin=MARGIN, renewal=RENEWAL)
    planner = planner or ShipLattice()
    return PlanFollower(planner, replanning=rule, interaction=default_interaction, stop=stop)


def ship_lattice_quick(planner: Planner | None = None, stop: Stop | None = None) -> PlanFollower:
    """`ship_lattice` with plans that are there after milliseconds."""
    return ship_lattice(planner or quick(), stop)


def ship_lattice_published(
    planner: Planner | None = None, stop: Stop | None = None
) -> PlanFollower:
    """The lattice of AUTO-IceNav as Bench-Push uses it: one plan, no optimisation."""
    return PlanFollower(planner or published(), replanning=Replanning(never=True), stop=stop)
