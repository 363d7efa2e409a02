"""What drives an environment of ``benchnpin``: a policy server of ours, or a policy of theirs.

Runs in the virtual environment of ``benchnpin``.
"""

from __future__ import annotations

import contextlib
import importlib.util
import io
import sys
from pathlib import Path

import dubins_paths
import numpy as np
from checkout import supply
from scenes import Scene

sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))

from serve_client import PolicyClient, ServeError

PLANNING = "benchnpin.baselines.{}.planning_based.policy"


class PolicyFailure(Exception):
    """A policy has failed in one episode; the next one may go well."""


class Served:
    """A policy server of ours.

    Args:
        scene: that is driven.
        address: of the server.
    """

    def __init__(self, scene: Scene, address: str) -> None:
        self._scene = scene
        self._client = PolicyClient(address)

    def begin(self, world: dict, seed: int) -> None:
        """Begin an episode in this world."""
        self._asked(self._client.reset, world, seed)

    def action(self, observation: object, info: dict) -> np.ndarray:
        """The environment's action."""
        twist = self._asked(self._client.act, **self._scene.state())["twist"]
        return self._scene.action(twist["linear"], twist["angular"])

    @staticmethod
    def _asked(request: object, *values: object, **named: object) -> dict:
        try:
            return request(*values, **named)
        except ServeError as error:
            raise PolicyFailure(str(error)) from None


class Theirs:
    """A policy of theirs.

    It has ``act(observation, **facts)``, as their ``BasePolicy``, or ``predict(observation,
    deterministic=True)``, as models of Stable-Baselines3.

    Args:
        scene: that is driven; its ``facts`` are the arguments of their own episode loops.
        policy: gives actions of the environment. ``reset()`` is called if it has one.
    """

    def __init__(self, scene: Scene, policy: object) -> None:
        self._scene = scene
        self._policy = policy

    def begin(self, world: dict, seed: int) -> None:
        """Begin an episode."""
        if hasattr(self._policy, "reset"):
            self._policy.reset()

    def action(self, observation: object, info: dict) -> np.ndarray:
        """The environment's action; `Scene.step` keeps it within its limits."""
        try:
            with contextlib.redirect_stdout(io.StringIO()):
                if hasattr(self._policy, "act"):
                    found = self._policy.act(observation, **self._scene.facts(info))
                else:
                    found, _ = self._policy.predict(observation, deterministic=True)
            return np.asarray(found, dtype=np.float64).reshape(-1)
        except Exception as error:
            raise PolicyFailure(f"{type(error).__name__}: {error}") from error


def policy_of(name: str, glns: str | None = None) -> object:
    """A policy of theirs: ``rrt``, ``lattice``, ``gtsp``, or ``FILE.py:CLASS``."""
    if name in PLANNERS:
        try:
            return PLANNERS[name](glns)
        except ImportError as error:
            raise SystemExit(
                f"theirs:{name}: the package in the registry does not have it ({error}); "
                "give --original, a checkout of the original's repository"
            ) from None
    file, _, kind = name.rpartition(":")
    if not file.endswith(".py") or not Path(file).is_file():
        raise SystemExit(
            f"theirs:{name} is none of {', '.join(PLANNERS)} and no FILE.py:CLASS that is there"
        )
    sys.path.insert(0, str(Path(file).resolve().parent))
    spec = importlib.util.spec_from_file_location(Path(file).stem, file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    if not hasattr(module, kind):
        raise SystemExit(f"{file} has no {kind}")
    return getattr(module, kind)()


def rrt(glns: str | None) -> object:
    """Its planner of the maze: a random tree among the boxes, once an episode."""
    planner = importlib.import_module(PLANNING.format("maze_NAMO")).PlanningBasedPolicy("RRT")
    planner.RRTPlanner.plot_env = lambda *args, **kwargs: None  # writes a picture
    return _blind(planner)


def lattice(glns: str | None) -> object:
    """Its planner of ships: A* on a state lattice, once an episode."""
    supply("dubins", **vars(dubins_paths))
    needs = "benchnpin.baselines.ship_ice_nav.planning_based.planners.predictive"
    supply(needs, PredictivePlanner=object)  # needs trained weights, and is not called
    module = importlib.import_module(PLANNING.format("ship_ice_nav"))
    return _blind(module.PlanningBasedPolicy("lattice"))


def gtsp(glns: str | None) -> object:
    """Its planner of area clearing: an order of the boxes, once an episode, by the solver GLNS."""
    module = importlib.import_module(PLANNING.format("area_clearing"))
    if glns is None:
        raise SystemExit("theirs:gtsp calls a solver: give --glns, the command of GLNS")

    class Planner(module.PlanningBasedPolicy):
        """As its episode loop calls it."""

        def act(self, observation: object, **facts: object) -> list:
            if self.path is None:
                static = (facts["boundary"], facts["walls"], facts["static_obstacles"])
                self.update_boundary_and_obstacles(*static)
            speed, turn = super().act(observation, **facts)
            return [speed / facts["target_speed"], turn / facts["action_scale"]]

    return _blind(Planner(glns))


def _blind(planner: object) -> object:
    """A planner that does not look at images."""
    planner.images = False
    return planner


PLANNERS = {"rrt": rrt, "lattice": lattice, "gtsp": gtsp}
