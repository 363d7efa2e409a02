"""`ChannelView`: a world in a frame that points ahead, with the near ice only."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pushplan.core import interaction
from pushplan.core import planners as core
from pushplan.interaction.ice_interaction import IceInteraction, IceSettings
from pushplan.motion.collision import footprint, goal_numbers, obstacles
from pushplan.motion.room_ahead import Room, is_boxed_in
from pushplan.motion.speed_profile import check_turns
from pushplan.planners.ship_predictive.predictive_config import PredictiveConfig
from pushplan.world import GoalLine, InvalidInputError, Movables, PlanStatus, World
from pushplan.world.checks import FloatArray, IntArray
from pushplan.world.planning_call import PlanningCall

STEEPEST = math.radians(80.0)
"""Greatest angle between the ship and the direction ahead in the table of costs to go."""
_HEADINGS = 17  # of the table
_MOST_PLACES = 20_000  # rows times columns of the table of costs to go, about
_ROW = 0.12  # distance between its rows [hull lengths]
_COLUMN = 0.1  # distance between its columns [hull lengths]


class Channel(NamedTuple):
    """Places where the ship's origin may be."""

    goal: float  # y of the line to which the search goes [m]
    low: FloatArray  # (2,) least x, y [m]
    high: FloatArray  # (2,) greatest x, y [m]


@dataclass(frozen=True)
class ChannelView:
    """Scene of a search in the frame of the channel, y ahead, the ship's start at x = 0."""

    world: World  # the snapshot, in the world frame
    turn: float  # angle by which the frame is turned against the world's [rad]
    start: FloatArray  # (3,) pose of the ship
    away: float  # y of the goal line [m]
    channel: Channel  # region of the ship's origin; its goal is the goal line, or one before it
    near: IntArray  # numbers of the floes that may be met
    objects: Movables  # they themselves, in the world frame
    floes: FloatArray  # (K, 3) their poses
    bodies: interaction.IceBodies  # their shapes and the hull's
    settings: IceSettings  # of their motion
    costs: core.IceCostToGo  # costs to go
    length: float  # of the hull [m]
    radius: float  # least turning radius [m]
    curvatures: FloatArray  # (B,) that the search uses [1/m]

    @property
    def closed(self) -> PlanStatus | None:
        """The status of a call in which no path is possible; None where one may be."""
        if not self.inside(self.start[None]):
            return PlanStatus.START_BLOCKED
        if self.away > self.channel.high[1]:
            return PlanStatus.GOAL_UNREACHABLE
        return None

    def without_path(self, call: PlanningCall) -> PlanStatus:
        """The status of a call that found no path; it proves nothing."""
        robot = self.world.robot
        goal = goal_numbers(self.world.navigation_goal, 0.0)
        room = Room(footprint(robot), obstacles(self.world.static), goal, 0.0)
        pose = self.world.robot_pose
        if is_boxed_in(robot, room, pose, robot.turning_radius, lambda: call.check(0, math.inf)):
            return PlanStatus.START_BLOCKED
        return call.stopped_status

    def to_world(self, poses: FloatArray) -> FloatArray:
        """Carry (..., 3) poses from the frame of the channel to the world's."""
        c = math.cos(self.turn)
        s = math.sin(self.turn)
        x = poses[..., 0]
        y = poses[..., 1]
        x0, y0 = self.world.robot_pose[:2]
        return np.stack(
            [x0 + c * x - s * y, y0 + s * x + c * y, poses[..., 2] + self.turn], axis=-1
        )

    def inside(self, poses: FloatArray) -> bool:
        """Return True if the ship's origin is in the channel and in bounds at all (N, 3) poses."""
        at = poses[:, :2]
        fits = bool((at >= self.channel.low).all() and (at <= self.channel.high).all())
        if not fits or not self.askew:
            return fits
        at = self.to_world(poses[:, :3])[:, :2]
        bounds = self.world.static.bounds
        slack = 1e-9 * self.length
        return bool((at >= bounds[:2] - slack).all() and (at <= bounds[2:] + slack).all())

    @property
    def askew(self) -> bool:
        """True if no side of the bounds is parallel to the goal line, so that the box is larger."""
        return abs(math.sin(2.0 * self.turn)) > 1e-9


def channel_view(
    world: World, config: PredictiveConfig, model: IceInteraction, turns: float = 0.0
) -> ChannelView:
    """Look at a world.

    Args:
        world: the snapshot.
        config: of the planner.
        model: of the ice.
        turns: room for turns to both sides of the way ahead [turning radii].

    Raises:
        InvalidInputError: if the goal is no line, something static is in the water, or the robot
            hardly turns.
    """
    line = world.goal
    if not isinstance(line, GoalLine):
        raise InvalidInputError(
            f"the predictive ship planners go to a GoalLine, got a {type(line).__name__}"
        )
    check_turns(world.robot)
    model.bodies(world)  # says if the world is none for it
    robot = world.robot
    length = float(np.ptp(robot.vertices[:, 0]))
    away = float((line.point - world.robot_pose[:2]) @ line.normal)
    turn = math.atan2(line.normal[1], line.normal[0]) - 0.5 * math.pi
    floes = _from_world(world.movables.poses, world.robot_pose, turn)
    reach = world.movables.radii + length
    goal = min(away, config.farthest * length)
    near = np.flatnonzero((floes[:, 1] > -reach) & (floes[:, 1] < goal + reach))
    off = math.remainder(float(world.robot_pose[2]) - turn - 0.5 * math.pi, math.tau)
    radius = robot.turning_radius / config.turn_fraction
    margin = config.margin * 0.5 * float(np.ptp(robot.vertices[:, 1])) + world.margin
    low, high = _box(world, turn, margin, (1.0 + 1e-6) * radius * (1.0 - math.cos(off)), off)
    # paths seldom lead farther from the straight one
    aside = 0.5 * max(goal, 0.0) + 5.0 * length + turns * radius
    low[0], high[0] = max(low[0], min(-aside, high[0])), min(high[0], max(aside, low[0]))
    channel = Channel(goal, low, high)
    objects = world.movables.select(near)
    floes = np.ascontiguousarray(floes[near])
    return ChannelView(
        world=world,
        turn=turn,
        start=np.array([0.0, 0.0, 0.5 * math.pi + off]),
        away=away,
        channel=channel,
        near=near,
        objects=objects,
        floes=floes,
        bodies=model.bodies(world, near),
        settings=model.settings(world),
        costs=_costs_to_go(world, config, objects, floes, channel, radius),
        length=length,
        radius=radius,
        curvatures=np.linspace(-1.0, 1.0, 2 * config.curvatures + 1) / radius,
    )


def _from_world(poses: FloatArray, origin: FloatArray, turn: float) -> FloatArray:
    c = math.cos(turn)
    s = math.sin(turn)
    dx = poses[:, 0] - origin[0]
    dy = poses[:, 1] - origin[1]
    return np.column_stack([c * dx + s * dy, c * dy - s * dx, poses[:, 2] - turn])


def _box(
    world: World, turn: float, margin: float, bulge: float, off: float
) -> tuple[FloatArray, FloatArray]:
    """Box of places for the ship's origin: the bounds, and less a margin at the sides.

    Where the goal line is not parallel to a side of the bounds, the box around them turned. The
    margin is given up as far as a ship needs the clearance to turn ahead: ``bulge`` [m] to the side
    to which it heads (``off`` [rad], positive to the left).
    """
    x0, y0, x1, y1 = world.static.bounds.tolist()
    corners = np.array([(x0, y0, 0.0), (x1, y0, 0.0), (x1, y1, 0.0), (x0, y1, 0.0)])
    box = _from_world(corners, world.robot_pose, turn)[:, :2]
    low = box.min(axis=0)
    high = box.max(axis=0)
    margin = min(margin, 0.25 * float(high[0] - low[0]))
    low[0] = min(low[0] + margin, max(low[0], -bulge if off > 0.0 else 0.0))
    high[0] = max(high[0] - margin, min(high[0], bulge if off < 0.0 else 0.0))
    return low, high


def _costs_to_go(
    world: World,
    config: PredictiveConfig,
    objects: Movables,
    floes: FloatArray,
    channel: Channel,
    radius: float,
) -> core.IceCostToGo:
    """Cost of the rest of the path if no floe moved: a table that guides the search.

    The table holds, for the ship's place and heading, the least of travel plus weighted work on a
    grid, by dynamic programming from the goal line backwards. The work of a metre is taken from the
    floes as they lie: each counts with its mass times 1 - d² / R², d being the distance of the bow
    from its centre and R their two half widths (after the collision cost of AUTO-IceNav, arXiv
    2411.17155), and more than in proportion where floes crowd.
    """
    vertices = world.robot.vertices
    length = float(np.ptp(vertices[:, 0]))
    away = max(channel.goal, 0.0)
    width = float(channel.high[0] - channel.low[0])
    ahead = away + length
    # a table over wide water is coarser, so that it is there in milliseconds
    places = (width / (_COLUMN * length)) * (ahead / (_ROW * length))
    coarser = length * max(1.0, math.sqrt(places / _MOST_PLACES))
    columns = max(2, math.ceil(width / (_COLUMN * coarser)) + 1)
    column = max(width / (columns - 1), 0.1 * _COLUMN * length)
    cell = 0.5 * column
    rows = max(2, math.ceil(ahead / (_ROW * coarser)) + 1)
    costs = core.IceCostToGo(
        table=np.empty((rows, columns, _HEADINGS)),
        field=np.empty((math.ceil((away + 3.0 * length) / cell) + 1, 2 * columns - 1)),
        left=float(channel.low[0]),
        low=-length,  # the tables begin a hull length behind the ship
        column=column,
        row=ahead / (rows - 1),
        cell=cell,
        bow=0.7 * float(vertices[:, 0].max()),
        mass=world.robot.mass,
        weight=config.push_weight,
        radius=radius,
    )
    radii = np.sqrt(objects.contact_areas / np.pi)
    costs.fill_field(floes, radii, objects.masses, 0.5 * float(np.ptp(vertices[:, 1])))
    costs.fill_table()
    return costs
