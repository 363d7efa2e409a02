"""The environments of ``benchnpin``, as worlds of pushplan and with velocities as actions.

Runs in the virtual environment of ``benchnpin``; knows pushplan by its world files only.
"""

from __future__ import annotations

import contextlib
import io
import math
import random
import sys

import numpy as np
import pymunk
from checkout import supply
from outlines import can_leave, convex, drawn_area, outline_of, pose_of, statics
from shapely.geometry import Polygon

PERIOD = 0.2
"""Time between two velocity actions where boxes have goals [s]."""


def idle_steps(step: float, speed: float) -> int:
    """Their idle limit, 200 heading actions of ``step`` [m] each, in velocity actions."""
    return 200 * math.ceil(step / (speed * PERIOD) - 1e-9)


def idle_time(step: float, speed: float) -> float:
    """The same in seconds."""
    return idle_steps(step, speed) * PERIOD


class Scene:
    """One environment of theirs; `reset` and `step` as theirs, `world` and `state` for ours.

    Attributes:
        period: time between two actions [s].
        own_limit: what ends an episode of theirs besides success, in words.
        idle_limit: time without progress after which they end an episode [s]; None if never.
    """

    name = ""
    metric = ""
    own_limit = ""
    idle_limit = None
    turns = math.pi / 30.0  # greatest turn rate of their actions [rad/s]
    drive = "constant_speed"
    needs_spfa = False  # for images

    def __init__(self, variation: str, images: bool = False) -> None:
        supply("spfa")  # no registry has it; it draws images, see `without_images`
        import benchnpin.environments  # noqa: F401  registers them
        import gymnasium

        with contextlib.redirect_stdout(io.StringIO()):
            self.env = gymnasium.make(
                self.name, cfg=self.config(variation), disable_env_checker=True
            )
        self.inner = self.env.unwrapped
        if not images:
            without_images(self.inner)
        elif self.needs_spfa and not hasattr(sys.modules["spfa"], "spfa"):
            raise SystemExit(f"images of {self.name} need the package spfa, which no registry has")

    def config(self, variation: str) -> dict:
        """What of their configuration differs from their default."""
        raise NotImplementedError

    def reset(self, seed: int) -> tuple[object, dict]:
        """Begin an episode; their starts come from Python's and NumPy's global generators."""
        random.seed(seed)
        np.random.seed(seed)
        self.inner.episode_idx = seed - 1  # where they take a numbered start
        self.inner.random_state = np.random.RandomState(seed)
        with contextlib.redirect_stdout(io.StringIO()):
            seen, info = self.env.reset()
        self.time = 0.0
        self.objects = list(self._shapes())
        return seen, info

    def step(self, action: np.ndarray) -> tuple[object, float, bool, bool, dict]:
        """Take an action for a period. It is clipped here, as their code clips none."""
        legal = np.clip(action, -1.0, 1.0)
        with contextlib.redirect_stdout(io.StringIO()):
            seen, reward, terminated, truncated, info = self.env.step(legal)
        self.time += self.period
        reward = float(np.asarray(reward).reshape(-1)[0])
        return seen, reward, bool(terminated), bool(truncated), info

    @property
    def period(self) -> float:
        """Time between two actions [s]."""
        return float(self.inner.dt)

    def action(self, linear: float, angular: float) -> np.ndarray:
        """Their action for these velocities [m/s, rad/s]."""
        return np.array([angular / self.turns])

    def facts(self, info: dict) -> dict:
        """What their planners are told besides the image, by the names in their episode loops."""
        return {}

    @property
    def body(self) -> pymunk.Body:
        """The robot."""
        raise NotImplementedError

    def _shapes(self) -> list:
        """The movable objects."""
        raise NotImplementedError

    def parts(self) -> list:
        """The robot's shapes that count, wheels last."""
        shapes = [one for one in self.body.shapes if label_of(one) != "wheel"]
        return sorted(shapes, key=label_of)

    wheels = 0  # how many of the parts do not count at walls

    def robot_mass(self) -> float:
        """As their metrics count it [kg]."""
        raise NotImplementedError

    def bounds(self) -> list:
        """x_min, y_min, x_max, y_max of the floor [m]."""
        raise NotImplementedError

    def goal(self, static: list) -> dict:
        """The goal, as in a world file."""
        raise NotImplementedError

    def speeds(self) -> tuple[float, float]:
        """Least and greatest forward speed [m/s]."""
        speed = float(self.inner.target_speed)
        return speed, speed

    def state(self) -> dict:
        """What changes, as a message of the policy server has it."""
        return {
            "time": self.time,
            "robot_pose": pose_of(self.body),
            "ids": [k for k, shape in enumerate(self.objects) if self.is_there(shape)],
            "poses": [pose_of(shape.body) for shape in self.objects if self.is_there(shape)],
        }

    def is_there(self, shape: pymunk.Shape) -> bool:
        """Whether an object of the start is still on the floor."""
        return shape.space is not None

    def world(self) -> dict:
        """The scene as a world file has it; call it after `reset`."""
        low, high = self.speeds()
        polygons, segments = statics(self.inner.space)
        parts = self.parts()
        refuse_unknown(self.name, self.body, parts)
        radius = max(float(part.radius) for part in parts)
        robot = {
            "name": self.name,
            "drive": self.drive,
            "mass": self.robot_mass(),
            "max_speed": high,
            "max_turn_rate": self.turns,
            "parts": [outline_of(part, part.radius - radius) for part in parts],
            "contact_radius": radius,
            "wheel_parts": self.wheels,
            "pose": pose_of(self.body),
        }
        if self.drive != "constant_speed":
            robot["min_speed"] = low
        return {
            "schema": "pushplan-world/1",
            "robot": robot,
            "static": {"bounds": self.bounds(), "polygons": polygons, "segments": segments},
            "movables": [
                {
                    "id": k,
                    "outline": outline_of(shape),
                    "contact_radius": float(shape.radius),
                    "pose": pose_of(shape.body),
                    "mass": drawn_area(shape),  # as their metrics count it: not `Shape.area`
                }
                for k, shape in enumerate(self.objects)
            ],
            "goal": self.goal(polygons),
        }


class MazeScene(Scene):
    """``maze-NAMO-v0``; variations ``3``, ``5``, ``10``: boxes."""

    name = "maze-NAMO-v0"
    metric = "maze_namo_metric:MazeNamoMetric"
    own_limit = "a wall, 400 steps"
    wheels = 4

    def config(self, variation: str) -> dict:
        return {"num_obstacles": int(variation), "randomize_obstacles": True}

    @property
    def body(self) -> pymunk.Body:
        return self.inner.robot_body

    def _shapes(self) -> list:
        return self.inner.polygons

    def parts(self) -> list:
        return [self.inner.robot_shape, *self.inner.wheels]

    def facts(self, info: dict) -> dict:
        return {
            "robot_pos": info["state"],
            "robot_radius": float(self.inner.cfg.robot.min_r),
            "goal": self.inner.goal,
            "maze_vertices": self.inner.maze_walls,
            "obstacles": info["obs"],
            "action_scale": float(self.inner.max_yaw_rate_step),
        }

    def robot_mass(self) -> float:
        return float(self.inner.cfg.robot.mass)

    def bounds(self) -> list:
        return [0.0, 0.0, float(self.inner.cfg.env.width), float(self.inner.cfg.env.length)]

    def goal(self, static: list) -> dict:
        cfg = self.inner.cfg
        center = [float(value) for value in self.inner.goal]
        return {
            "kind": "disc",
            "center": center,
            "radius": float(cfg.goal_radius + cfg.robot.min_r),
        }


class ShipScene(Scene):
    """``ship-ice-v0``; variations ``10`` to ``50``: concentration [%]."""

    name = "ship-ice-v0"
    metric = "ship_ice_metric:ShipIceMetric"
    own_limit = "the sides of the channel, 300 steps"
    turns = math.pi / 14.0

    def config(self, variation: str) -> dict:
        return {"concentration": int(variation) / 100.0}

    @property
    def body(self) -> pymunk.Body:
        return self.inner.ship_body

    def _shapes(self) -> list:
        return self.inner.polygons

    def parts(self) -> list:
        return [self.inner.ship_shape]

    def facts(self, info: dict) -> dict:
        return {
            "ship_pos": info["state"],
            "obstacles": info["obs"],
            "goal": self.inner.goal,
            "conc": self.inner.cfg.concentration,
            "action_scale": float(self.inner.max_yaw_rate_step),
        }

    def robot_mass(self) -> float:
        return float(self.inner.cfg.ship.mass)

    def bounds(self) -> list:
        occ = self.inner.cfg.occ
        return [0.0, 0.0, float(occ.map_width), float(occ.map_height)]

    def goal(self, static: list) -> dict:
        middle = 0.5 * float(self.inner.cfg.occ.map_width)
        return {"kind": "line", "point": [middle, float(self.inner.goal[1])], "normal": [0.0, 1.0]}


class AreaScene(Scene):
    """``area-clearing-v0`` with velocities; variations are the names of its environments.

    ``clear_env_turning`` is ``clear_env`` with ten times the turn rate: its heading actions, which
    its learned policies have, turn the robot at any rate.
    """

    name = "area-clearing-v0"
    metric = "task_driven_metric:TaskDrivenMetric"
    own_limit = "200 of their steps of 1.5 m since the last box was cleared"
    idle_limit = idle_time(1.5, 0.2)
    turns = math.pi / 60.0  # half of what its attribute says, as its velocity action has it
    drive = "differential"
    needs_spfa = True

    def __init__(self, variation: str, images: bool = False) -> None:
        name = variation.removesuffix("_turning")
        super().__init__(name, images)
        if name != variation:
            self.turns = 10.0 * self.turns
            self.inner.max_yaw_rate_step *= 10.0

    def config(self, variation: str) -> dict:
        return {
            "env": variation,
            "agent": {"action_type": "velocity"},
            "render": {"show": False, "log_obs": False},
            "sim": {"t_max": idle_steps(1.5, 0.2)},
        }

    def action(self, linear: float, angular: float) -> np.ndarray:
        return np.array([linear / float(self.inner.target_speed), angular / self.turns])

    def facts(self, info: dict) -> dict:
        return {
            "agent_pos": info["state"],
            "obstacles": info["obs"],
            "boundary": self.inner.boundary_vertices,
            "walls": self.inner.walls,
            "static_obstacles": self.inner.static_obstacles,
            "target_speed": float(self.inner.target_speed),
            "action_scale": float(self.inner.max_yaw_rate_step),
        }

    def speeds(self) -> tuple[float, float]:
        speed = float(self.inner.target_speed)
        return -speed, speed

    @property
    def body(self) -> pymunk.Body:
        return self.inner.agent.body

    def _shapes(self) -> list:
        return self.inner.box_shapes

    def robot_mass(self) -> float:
        return float(self.inner.cfg.agent.mass)

    def bounds(self) -> list:
        x, y = np.array(self.inner.outer_boundary_vertices).T
        return [float(x.min()), float(y.min()), float(x.max()), float(y.max())]

    def goal(self, static: list) -> dict:
        polygon = convex(self.inner.boundary_vertices)
        size = 2.0 * float(self.inner.cfg.obstacle_size)
        walls = [Polygon(one) for one in static]
        closing = zip(polygon, polygon[1:] + polygon[:1], strict=True)
        edges = [can_leave(np.array(a), np.array(b), size, walls) for a, b in closing]
        return {"kind": "clearance_area", "polygon": polygon, "open_edges": edges}


class DeliveryScene(Scene):
    """``box-delivery-v0`` with velocities; variations are the names of its layouts."""

    name = "box-delivery-v0"
    metric = "task_driven_metric:TaskDrivenMetric"
    own_limit = "200 of their steps of 1.25 m since the last box was delivered"
    idle_limit = idle_time(1.25, 0.3)
    turns = 1.0
    drive = "differential"
    needs_spfa = True

    def config(self, variation: str) -> dict:
        return {
            "env": {"obstacle_config": variation},
            "agent": {"action_type": "velocity"},
            "render": {"show": False, "show_obs": False},
            "misc": {"inactivity_cutoff": idle_steps(1.25, 0.3)},
        }

    @property
    def period(self) -> float:
        # after each action it steps twice more, to see whether anything still moves
        return float(self.inner.dt * (self.inner.steps + 2) / self.inner.steps)

    def action(self, linear: float, angular: float) -> np.ndarray:
        return np.array([linear, angular])

    def speeds(self) -> tuple[float, float]:
        speed = float(self.inner.target_speed)
        return -speed, speed

    @property
    def body(self) -> pymunk.Body:
        return self.inner.robot.body

    def _shapes(self) -> list:
        return self.inner.boxes

    def robot_mass(self) -> float:
        return float(self.inner.cfg.agent.mass)

    def bounds(self) -> list:
        x = 0.5 * self.inner.room_length
        y = 0.5 * self.inner.room_width
        return [-float(x), -float(y), float(x), float(y)]

    def goal(self, static: list) -> dict:
        (x, y) = self.inner.receptacle_position
        size = self.inner.receptacle_size
        half = 0.5 * float(size)
        corners = [[x - half, y - half], [x + half, y - half], [x + half, y + half]]
        return {"kind": "receptacle", "polygon": convex([*corners, [x - half, y + half]])}


SCENES = {
    "maze": (MazeScene, ("3", "5", "10")),
    "ship_ice": (ShipScene, ("10", "20", "30", "40", "50")),
    "area_clearing": (
        AreaScene,
        ("clear_env", "clear_env_turning", "walled_env", "walled_env_with_columns"),
    ),
    "box_delivery": (DeliveryScene, ("small_empty", "small_columns")),
}


def label_of(shape: pymunk.Shape) -> str:
    """What their code calls a shape."""
    return getattr(shape, "label", None) or ""


def refuse_unknown(name: str, body: pymunk.Body, parts: list) -> None:
    """End where the robot touches with more than planners are told."""
    for shape in body.shapes:
        known = shape in parts and isinstance(shape, pymunk.Poly)
        if not (known or shape.sensor or label_of(shape) == "wheel"):
            raise SystemExit(
                f"the robot of {name} has a {type(shape).__name__} {label_of(shape)!r}, which this "
                "bridge does not know: planners would not heed it"
            )


def without_images(inner: object) -> None:
    """Leave out what only images and rewards need: it takes seconds a step and moves nothing."""
    nothing = np.zeros(inner.observation_space.shape, inner.observation_space.dtype)
    inner.generate_observation = lambda *args, **kwargs: nothing
    for name in ("create_global_shortest_path_to_goal_points", "shortest_path_distance"):
        if hasattr(inner, name):
            setattr(inner, name, lambda *args, **kwargs: 0.0)
