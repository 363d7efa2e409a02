"""Calls every binding of one room of the core with arguments that are wrong in many ways.

Run as a program, with a room and a number of random calls: a crash ends the process, and
``test_core_doors.py`` sees it.
"""

from __future__ import annotations

import ctypes
import faulthandler
import functools
import importlib
import json
import os
import re
import resource
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum
from types import ModuleType
from typing import Any

import numpy as np

# Functions and classes whose arrays point into each other, so that checking them would take as long
# as the work. Each is called by one module of Python, which makes them from one checked object.
# They are called with wrong types only, which nanobind refuses, and not with right ones.
TABLES_OF_ONE_MAKER = {
    "envs.PlanarSimulator": "addresses of an engine, and states of its bodies",
    "gtsp.Problem.__init__": "tables that gtsp makes of one checked graph",
    "gtsp.RuinRecreate.narrow": "a part of the same tables",
    "gtsp.extend_paths": "walks of gtsp, in the order in which it numbers clusters",
    "gtsp.extend_walks": "walks of gtsp",
    "gtsp.fill_subsets": "walks of gtsp",
    "gtsp.mark_needed": "tables of one checked graph",
    "gtsp.read_visits": "walks of gtsp",
    "interaction.CalledInteraction.__init__": "the address of a function",
    "motion.PoseLattice.__init__": "maps and swaths that motion.state_lattice makes of a lattice",
    "motion.place_costs": "a part of the lattice",
    "motion.swath_sum": "a part of the lattice",
    "motion.sweep_cells": "cells of a footprint of a checked size",
    "pushing.PushAssembly": "arrays of one number of steps, which only tests hand over",
    "pushing.PushingProblem": "arrays of one number of steps, which only tests hand over",
}
# Numbers of rounds: a large one is meant to take long.
ROUNDS = {"budget", "first_rounds", "iterations", "most", "rounds", "steps", "tries"}

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
SQUARES = np.vstack([SQUARE, SQUARE + np.array([3.0, 0.0])])
HIGHER = SQUARES + np.array([0.0, 5.0])
AROUND = np.array([[0.0, 0.0, 1.0, 1.0], [3.0, 0.0, 4.0, 1.0]])
UP = np.array([0.0, 5.0, 0.0, 5.0])
OFFSETS = [0, 4, 8]
WIDE = [-9.0, -9.0, 9.0, 9.0]
PATH = np.array([[0.2 * i, 0.0, 0.0] for i in range(8)])

# A model of interaction in which nothing is moved.
NO_MOTION = ctypes.CFUNCTYPE(ctypes.c_bool, *[ctypes.c_void_p] * 6)(lambda *_: True)

# Arguments of valid calls: by function and name, or by name.
VALID: dict[str, Any] = {
    "function": ctypes.cast(NO_MOTION, ctypes.c_void_p).value,
    "vertices": SQUARES,
    "robot_vertices": SQUARES,
    "hull_vertices": SQUARES,
    "wall_vertices": HIGHER,
    "outlines": SQUARES,
    "loops": SQUARES,
    "blocks": SQUARES,
    "parts": SQUARES,
    "corners": SQUARES,
    "outline": SQUARE,
    "polygon": SQUARE,
    "core": SQUARE,
    "a": SQUARE,
    "b": SQUARE,
    "vertices_px": SQUARE,
    "offsets": OFFSETS,
    "robot_offsets": OFFSETS,
    "hull_offsets": OFFSETS,
    "wall_offsets": OFFSETS,
    "part_offsets": OFFSETS,
    "part_vertices": SQUARES,
    "first_parts": [0, 1, 2],
    "block_offsets": OFFSETS,
    "neighbour_offsets": [0, 1, 2],
    "neighbours": [1, 0],
    "boxes": AROUND,
    "wall_boxes": AROUND + UP,
    "groups": [[0.0, 0.0, 4.0, 1.0]],
    "box": WIDE,
    "bounds": WIDE,
    "low": [-9.0, -9.0],
    "high": [9.0, 9.0],
    "goal": [0.0, 2.0, 2.0, 0.5, 0.0],
    "view": [0.0, 0.0, 0.0, 8.0, 8.0, 0.5, 0.5],
    "limits": [-1.0, 1.0, 1.0, 0.5, 0.5, 0.0],
    "evidence": [1.5, -0.4, -2.0, 4.5],
    "bearings": [0.0, 1.0],
    "passed": [1.0, 2.0],
    "hits": [1.0, np.inf],
    "radii": [1.5, 1.5],
    "poses": [[0.0, 0.0, 0.0], [2.0, 0.5, 0.3]],
    "objects": [[0.0, 0.0, 0.0], [2.0, 0.5, 0.3]],
    "before": [[0.0, 0.0, 0.0], [2.0, 0.5, 0.3]],
    "discs": [[0.0, 0.0, 1.0], [2.0, 2.0, 0.0]],
    "half_planes": [[0.0, 0.0, 1.0, 0.0]],
    "edges": [[1.0, 0.0, 1.0], [0.0, 1.0, 1.0]],
    "drag": np.ones((2, 4)),
    "start": [-1.0, 0.0, 0.0],
    "image": np.zeros((8, 8)),
    "mask": np.zeros((8, 8)),
    "grid": np.ones((6, 4)),
    "draws": np.full((3, 4), 0.5),
    "normals": np.full((3, 2), 0.5),
    "curvatures": [-0.5, 0.5],
    "wanted": [True, False],
    "values": np.ones((4, 4)),
    "walls": None,
    "arcs": [[0.5, 0.2], [0.5, 0.0]],
    "pieces": [[0.5, 0.2], [0.5, 0.0]],
    "moves": [[0.5, 0.2], [0.5, -0.2]],
    "path": PATH,
    "out": np.zeros((8, 2)),
    "twists": np.full((3, 2), 0.1),
    "wall_parts": 2,
    "last": 2,
    "first": 0,
    "longest": 20,
    "half": 20,
    "headings": 16,
    "budget": 50,
    "upto": 50,
    "most": 5,
    "seed": 3,
    # geometry
    "geometry.transform_outlines.out": np.zeros((8, 2)),
    "geometry.Obstacles.fill_clearance.out": np.zeros((4, 4)),
    "geometry.Obstacles.fill_clearance.last": 16,
    "geometry.StaticMap.lines": [[0.0, 3.0, 2.0, 3.0], [5.0, 5.0, 5.0, 5.0]],
    "geometry.ShortestPath.start": [-2.0, -2.0],
    "geometry.GoalDistances.path_from.start": [-2.0, -2.0],
    "geometry.GoalDistances.fill.out": np.zeros((4, 4)),
    "geometry.GrownMap.fill_bend_distances.table": np.zeros((4, 4, 208)),
    "geometry.sample_points.out": np.zeros(2),
    # gtsp
    "gtsp.Problem.costs": np.ones((3, 6)),
    "gtsp.Problem.reverse": np.ones((3, 6)),
    "gtsp.Problem.into": np.ones((3, 3)),
    "gtsp.Problem.onto": np.ones((3, 3)),
    "gtsp.Problem.offsets": [0, 1, 2, 3],
    "gtsp.Problem.near": [[1, 2], [0, 2], [0, 1]],
    "gtsp.Problem.between": np.ones((3, 2)),
    "gtsp.RuinRecreate.order": [0, 1, 2],
    "gtsp.RuinRecreate.start.order": [0, 2, 1],
    # interaction
    "interaction.QuasiStatic.iterations": 30,
    "interaction.QuasiStatic.max_step": 0.05,
    "interaction.QuasiStatic.sweep.out": np.zeros((8, 2, 3)),
    "interaction.IceContacts.sweep.out": np.zeros((8, 2, 3)),
    "interaction.sweep_near.out": np.zeros((8, 2, 3)),
    "interaction.sweep_near.works": np.zeros(7),
    "interaction.step_works.swept": np.zeros((3, 2, 3)),
    "interaction.cover_objects.out": np.zeros((4, 4)),
    "interaction.cover_sweep.out": np.zeros((4, 4)),
    # motion
    "motion.shortest_curve.arcs": np.zeros((5, 2)),
    "motion.sample_pieces.out": np.zeros((30, 3)),
    "motion.sample_pieces.curvatures": np.zeros(30),
    "motion.prefix_sums.sums": np.zeros((4, 7)),
    "motion.place_costs.sums": np.zeros((9, 10)),
    "motion.place_costs.rows": [3, 4],
    "motion.place_costs.columns": [3, 4],
    "motion.place_costs.goal_row": 6,
    "motion.place_costs.half": 1,
    "motion.place_costs.between": (1, 7),
    "motion.fill_connections.out": np.zeros((9, 9)),
    "motion.fill_connections.reach": 4,
    "motion.primitive_boxes.headings": [0.0, 0.5],
    "motion.primitive_boxes.pieces": np.full((2, 3, 2), 0.3),
    "motion.primitive_boxes.boxes": np.zeros((2, 4)),
    "motion.PoseLattice.rows": 2,
    "motion.PoseLattice.columns": 2,
    "motion.PoseLattice.corner": [1, 1],
    "motion.PoseLattice.first": [0, 1],
    "motion.PoseLattice.ends": [[1, 0, 0]],
    "motion.PoseLattice.lengths": [1.0],
    "motion.PoseLattice.boxes": [[0.0, 1.0, 0.0, 0.0]],
    "motion.PoseLattice.run_first": [0, 1],
    "motion.PoseLattice.runs": [[0, 1]],
    "motion.PoseLattice.cost_sums": np.zeros(30),
    "motion.PoseLattice.blocked_sums": np.zeros(30),
    "motion.PoseLattice.stride": 5,
    "motion.PoseLattice.planes": [[1.0, 0.0, 9.0]],
    "motion.PoseLattice.goal": [1.0, 1.0, 0.0, 0.5],
    "motion.PoseLattice.row_bounds": np.zeros((1, 2)),
    "motion.LatticeSearch.size": 4,
    "motion.swath_sum.sums": np.zeros(9),
    "motion.swath_sum.runs": [[0, 1]],
    "motion.swath_sum.begin": 0,
    "motion.sweep_cells.reach": 6.0,
    "motion.MoreObstacles.vertices": HIGHER,
    "motion.fill_speed_profile.curvatures": np.zeros(8),
    "motion.fill_speed_profile.chords": np.full(7, 0.2),
    "motion.fill_speed_profile.times": np.zeros(8),
    "motion.fill_speed_profile.speeds": np.zeros(8),
    "motion.fill_speed_profile.turn_rates": np.zeros(8),
    "motion.Reachable.start": [-2.0, -2.0],
    "motion.recovery_path.steps": [[0.04, 0.0], [0.0, 0.08]],
    # navigation
    "navigation.Robot.vertices": SQUARES - 0.5,
    "navigation.Robot.limits": [1.0, 0.5, 0.0, 0.5, 0.0, np.inf, np.inf],
    "navigation.World.pose": [-5.0, -5.0, 0.0],
    "navigation.World.goal": [0.0, 6.0, -6.0, 0.5, 0.0, np.nan, 0.0],
    # observation
    "observation.to_pixels.out": np.zeros((2, 2)),
    "observation.fill_hidden.table": np.zeros((4, 4, 2)),
    "observation.fill_hidden.bends": [0, 1],
    # planners
    "planners.RolloutProblem.substeps": 2,
    "planners.Rollouts.paths": np.zeros((2, 7, 3)),
    "planners.Rollouts.twists": np.zeros((2, 3, 2)),
    "planners.Rollouts.ends": [6, 6],
    "planners.Rollouts.objects": np.zeros((2, 2, 3)),
    "planners.roll_robots.controls": np.full((2, 3, 2), 0.5),
    "planners.propose_change.poses": PATH,
    "planners.propose_change.curvatures": np.zeros(8),
    "planners.propose_change.draws": np.full(4, 0.5),
    "planners.propose_change.normals": np.full(2, 0.5),
    "planners.propose_change.problem": [0.5, 0.2, 0.3, 9.0, 0.2, 2.0, 0.0, 1.0, 0.0],
    "planners.propose_change.out": np.zeros((99, 3)),
    "planners.propose_change.out_curvatures": np.zeros(99),
    "planners.IceCostToGo.table": np.zeros((4, 4, 5)),
    "planners.IceCostToGo.field": np.zeros((6, 6)),
    "planners.IceCostToGo.low": 0.0,
    "planners.IceCostToGo.cost_ahead.arc": np.zeros((3, 4)),
    "planners.IceCostToGo.steer_on.out": np.zeros((3, 4)),
    "planners.arc_ahead.out": np.zeros((3, 4)),
    # pushing
    "pushing.BoxContact.half": 0.3,
    "pushing.BoxContact.low": -0.5,
    "pushing.BoxContact.high": 0.5,
    "pushing.BoxContact.roll_out.twists": np.full((3, 2), 0.1),
    "pushing.BoxContact.roll_out.steps": np.full(3, 0.1),
    "pushing.BoxContact.roll_out.states": np.zeros((4, 6)),
    "pushing.BoxContact.roll_out.motions": np.zeros((3, 6)),
    "pushing.PushingProblem.groups": [0, 0],
    "pushing.PushWeights.half": 0.3,
    "pushing.PushAssembly.steps": 2,
    "pushing.PushAssembly.assemble.nominal": np.full((1, 2), 0.1),
    "pushing.PushTracker.groups": [0, 1],
    # control
    "control.ReferencePath.poses": PATH,
    "control.ReferencePath.lengths": 0.2 * np.arange(8),
    "control.ReferencePath.speeds": np.ones(8),
    "control.Tracker.steps": 2,
    "control.Tuning.optimise_speed": True,
    # rearrangement
    "rearrangement.cost_to_go.costs": np.ones((3, 2)),
    "rearrangement.cost_to_go.delivers": [1, 2],
    "rearrangement.cost_to_go.objects": 2,
    "rearrangement.PoseGrid.rows": 3,
    "rearrangement.PoseGrid.columns": 3,
    "rearrangement.PoseGrid.search.starts": [0, 1],
    "rearrangement.PoseGrid.search.depths": np.zeros((16, 3, 3)),
    "rearrangement.PoseGrid.search.touch": np.zeros((16, 3, 3)),
    "rearrangement.PoseGrid.search.targets": [20],
    "rearrangement.add_layers.layers": np.zeros((2, 16, 3, 3)),
    "rearrangement.least_costs.nodes": [0, 1],
    "rearrangement.least_costs.ends": [1, 2],
    "rearrangement.pushable_moves.middles": np.zeros((3, 3, 2)),
    "rearrangement.pushable_moves.is_open": np.ones((3, 3)),
    "rearrangement.push_costs.is_open": np.ones((3, 3)),
    "rearrangement.push_costs.pushable": np.ones((16, 3, 3)),
    "rearrangement.PushingController.steer_push.path": SQUARE,
    "rearrangement.along_path.path": SQUARE,
    "rearrangement.PushRollout.run.path": SQUARE,
    "rearrangement.PushRollout.iterations": 30,
    # scenarios
    "scenarios.fit_floes.shapes": np.tile(SQUARE - 0.5, (2, 1, 1)),
    "scenarios.fit_floes.shape_counts": [4, 4],
    "scenarios.fit_floes.cells": np.tile(3.0 * (SQUARE - 0.5), (2, 1, 1)),
    "scenarios.fit_floes.cell_counts": [4, 4],
    "scenarios.place_discs.draws": np.full((2, 5, 3), 0.5),
    # search
    "search.SearchTree.size": 4,
    "search.SearchTree.offer.parent": -1,
    "search.GridDijkstra.weights": np.ones((4, 4)),
    "search.GridDijkstra.settle.goals": np.zeros((4, 4)),
}


def pushed_box() -> tuple[Any, ...]:
    """A face of a square, what is kept clear, and the direction of the push."""
    pushing = importlib.import_module("pushplan._core").pushing
    contact = pushing.BoxContact(0.3, 0.2, 0.0, 0.1, -0.1, 0.1, 0.05, 0.3)
    parts = pushing.Clearance(SQUARES, np.array(OFFSETS), np.ones(2), 0.01, 0.001)
    return [pushing.Face(np.array([1.0, 0.0, 0.0]), contact, 0.0, -1.0)], parts, 0.0


# Classes without a constructor, and what makes one.
MADE_BY = {
    "geometry.GrownMap": "geometry.StaticMap.grown",
    "geometry.Obstacles": "geometry.GrownMap.obstacles",
    "motion.RoomExploration": "motion.explore_ahead",
}
# What an object needs before it answers.
PREPARED = {
    "pushing.PushTracker": lambda tracker: tracker.begin(*pushed_box()),
    "search.SearchTree": lambda tree: (tree.clear(), tree.offer(1, 0.5, 0.5, -1, 0)),
    "navigation.World": lambda world: world.set_objects(
        *map(np.array, (SQUARES, OFFSETS, VALID["first_parts"], VALID["poses"])), *np.ones((2, 2))
    ),
}


@dataclass(frozen=True)
class Parameter:
    """A parameter of a binding, with its type as nanobind writes it."""

    name: str
    kind: str  # "float", "int", "bool", "array", "tuple", "list", or a class of the core
    dtype: str = ""
    shape: tuple[int | None, ...] = ()


@dataclass(frozen=True)
class Signature:
    """A way to call a function or a method; a class by its constructor."""

    name: str  # with its room, and its class
    parameters: tuple[Parameter, ...]
    parts: dict[str, tuple[Parameter, ...]] = field(default_factory=dict)  # of tuples


def split(text: str) -> Iterator[str]:
    """Yield the parts between commas that are in no bracket."""
    depth = 0
    part = ""
    for letter in text:
        depth += (letter in "([") - (letter in ")]")
        if letter == "," and depth == 0:
            yield part.strip()
            part = ""
        else:
            part += letter
    if part.strip():
        yield part.strip()


@functools.cache
def parameter(name: str, text: str) -> Parameter:
    text = text.split(" = ")[0]
    if array := re.match(r"ndarray\[dtype=(\w+), shape=\(([^)]*)\)", text):
        extents = (part.strip() for part in array[2].split(","))
        shape = tuple(None if extent == "*" else int(extent) for extent in extents if extent)
        return Parameter(name, "array", array[1], shape)
    for prefix, kind in (("tuple[", "tuple"), ("collections.abc.Sequence[", "list")):
        if text.startswith(prefix):
            return Parameter(name, kind, text.removeprefix(prefix)[:-1])
    return Parameter(name, text.removeprefix("pushplan._core."))


@functools.cache
def signatures_of(room: ModuleType) -> tuple[Signature, ...]:
    """Every way to call what a room binds."""
    return tuple(_read_signatures(room))


def _read_signatures(room: ModuleType) -> Iterator[Signature]:
    short = room.__name__.rsplit(".", 1)[1]
    for name, bound in vars(room).items():
        methods = vars(bound).items() if isinstance(bound, type) else [("", bound)]
        for method, function in methods:
            for text, *_ in getattr(function, "__nb_signature__", ()):
                listed = text[text.index("(") + 1 : text.rindex(") ->")]
                parts = [part.partition(": ") for part in split(listed) if part != "self"]
                full = ".".join(part for part in (short, name, method) if part)
                yield Signature(full, tuple(parameter(left, right) for left, _, right in parts))


def is_left_out(name: str) -> bool:
    parts = name.split(".")
    return any(".".join(parts[:n]) in TABLES_OF_ONE_MAKER for n in range(1, len(parts) + 1))


class Caller:
    """Makes arguments and calls, and counts what comes of them."""

    def __init__(self, room: str, log: str) -> None:
        core = importlib.import_module("pushplan._core")
        self.rooms = {
            name: module for name, module in vars(core).items() if isinstance(module, ModuleType)
        }
        self.signatures = list(signatures_of(self.rooms[room]))
        self.constructors = {
            signature.name.removesuffix(".__init__"): signature
            for module in self.rooms.values()
            for signature in signatures_of(module)
            if signature.name.endswith(".__init__")
        }
        self.log = os.open(log, os.O_WRONLY | os.O_CREAT)
        self.random = np.random.default_rng(0)
        self.results = 0
        self.refusals = 0
        self.mutation = 0.0  # chance that an argument is wrong
        self.unexpected: dict[str, str] = {}

    # -------------------------------------------------------------- valid arguments

    def valid(self, owner: str, wanted: Parameter) -> Any:
        """An argument that a call accepts; ``owner`` is the function."""
        owner = owner.removesuffix(".__init__")
        known = VALID.get(f"{owner}.{wanted.name}", VALID.get(wanted.name))
        if wanted.kind == "array":
            return self.array(wanted, known)
        if wanted.kind in ("float", "int", "bool"):
            if known is None or isinstance(known, (list, np.ndarray)):
                known = {"float": 0.5, "int": 1, "bool": False}[wanted.kind]
            return {"float": float, "int": int, "bool": bool}[wanted.kind](known)
        if wanted.kind == "tuple":
            if known is not None:
                return known
            parts = [parameter(wanted.name, part) for part in split(wanted.dtype)]
            return tuple(self.valid(owner, part) for part in parts)
        if wanted.kind == "list":
            return [self.valid(owner, parameter("item", wanted.dtype)) for _ in range(2)]
        if wanted.kind.startswith("object"):
            return None
        if wanted.kind == "str":
            return self.instance("navigation.World").written()
        if wanted.kind.endswith(" | None") and self.random.random() < 0.5:
            return None
        return self.instance(wanted.kind.removesuffix(" | None"))

    def array(self, wanted: Parameter, known: Any) -> np.ndarray:
        shape = [2 if extent is None else extent for extent in wanted.shape]
        fits = known is not None and not np.isscalar(known)
        if fits:
            made = np.array(known)
            fits = made.ndim == len(shape) and all(
                extent in (None, size)
                for extent, size in zip(wanted.shape, made.shape, strict=True)
            )
        if not fits:
            made = np.full(shape, 0.5 if wanted.dtype.startswith("float") else 0)
        return np.ascontiguousarray(made, dtype=wanted.dtype)

    def instance(self, name: str) -> Any:
        """An object of a class of the core, perhaps of wrong arguments."""
        room, short = name.split(".")
        kind = getattr(self.rooms[room], short)
        if issubclass(kind, Enum):
            return next(iter(kind))
        if maker := MADE_BY.get(name):
            made = self.bound(maker)
            signatures = [one for one in self.all_of(room) if one.name == maker]
            return made(*self.arguments(signatures[0])) if signatures else made
        made = kind(*self.arguments(self.constructors[name]))
        PREPARED.get(name, lambda _: None)(made)
        return made

    def bound(self, name: str) -> Any:
        """A function, a method of an object that is made for it, or a class."""
        room, short, *method = name.removesuffix(".__init__").split(".")
        if method:
            return getattr(self.instance(f"{room}.{short}"), method[0])
        return getattr(self.rooms[room], short)

    def all_of(self, room: str) -> tuple[Signature, ...]:
        return signatures_of(self.rooms[room])

    def arguments(self, signature: Signature) -> list[Any]:
        return [self.argument(signature, wanted) for wanted in signature.parameters]

    def argument(self, signature: Signature, wanted: Parameter) -> Any:
        right = self.valid(signature.name, wanted)
        if self.mutation == 0.0 or self.random.random() >= self.mutation:
            return right
        wrong = list(self.wrong(signature.name, wanted, right))
        return wrong[self.random.integers(len(wrong))]

    # -------------------------------------------------------------- wrong arguments

    def wrong(self, owner: str, wanted: Parameter, right: Any) -> Iterator[Any]:
        """Yield arguments of the wrong type, and wrong in numbers if the function checks them."""
        yield from (None, "text", object(), {})
        checked = not is_left_out(owner)
        if wanted.kind == "array":
            yield from self.wrong_types(right)
            if checked:
                yield from self.wrong_layouts(right)
                yield from self.wrong_sizes(right)
                yield from self.wrong_numbers(right)
        elif wanted.kind == "int":
            yield from (1.5, -(2**63) - 1, 2**200)
            if checked and wanted.name not in ROUNDS:
                yield from (0, -1, 2, right + 1, 2**31, 2**62, 2**63 - 1, 2**63, -(2**62), -(2**63))
        elif wanted.kind == "float":
            yield from (1j, [0.5])
            if checked:
                yield from (0.0, -1.0, np.nan, np.inf, -np.inf, 1e300)
        elif wanted.kind == "tuple" and len(right) > 0:
            yield right[:-1]
            yield (*right, right[0])
        elif wanted.kind == "str":
            yield from (right[1:], right[: len(right) // 2], right.replace("0", "-1"))
        elif wanted.kind not in ("bool", "list"):
            yield self.rooms["search"].SearchTree(2)

    def wrong_types(self, right: np.ndarray) -> Iterator[Any]:
        yield right.tolist()
        for dtype in ("float32", "float64", "int32", "int64", "complex128", "object", ">f8"):
            if right.dtype != dtype:
                yield right.astype(dtype)
        yield right[None]
        yield right[..., None]

    def wrong_layouts(self, right: np.ndarray) -> Iterator[np.ndarray]:
        yield right[0]
        yield np.repeat(right, 2, axis=-1)[..., ::2]
        yield right[::-1]
        if right.ndim > 1:
            yield np.asfortranarray(right)
        still = right.copy()
        still.flags.writeable = False
        yield still

    def wrong_sizes(self, right: np.ndarray) -> Iterator[np.ndarray]:
        for axis, size in enumerate(right.shape):
            for extent in (0, size - 1, size + 1, 3 * size):
                yield np.ascontiguousarray(np.resize(right, _with(right.shape, axis, extent)))

    def wrong_numbers(self, right: np.ndarray) -> Iterator[np.ndarray]:
        if right.dtype.kind == "f":
            numbers: tuple[float, ...] = (np.nan, np.inf, -np.inf, -1.0, 0.0)
        elif right.dtype == np.int64:
            numbers = (0, -1, 1, 2**31, 2**62, 2**63 - 1, -(2**62), -(2**63))
        else:
            numbers = (0, 1)
        for number in numbers:
            yield np.full_like(right, number)
            if right.size:
                one = right.copy()
                one.flat[self.random.integers(right.size)] = number
                yield one
        yield np.ascontiguousarray(right[::-1])

    # -------------------------------------------------------------- calls

    def call(self, signature: Signature, position: int = -1, wrong: Any = None) -> bool:
        """Call a function with an argument that is wrong, or none; say whether it returned."""
        line = f"{signature.name} {position} {_shown(wrong)} {self.results + self.refusals}"
        if position < 0 and is_left_out(signature.name):
            return True
        os.pwrite(self.log, line.encode().ljust(300)[:299] + b"\n", 0)
        try:
            arguments = self.arguments(signature)
            if position >= 0:
                arguments[position] = wrong
            made = self.bound(signature.name)(*arguments)
            if signature.name.endswith(".__init__"):
                self.use(signature.name.removesuffix(".__init__"), made)
        except (TypeError, ValueError, OverflowError, IndexError, MemoryError) as error:
            self.refusals += 1
            self.last = f"{type(error).__name__}: {error}"
            return False
        self.results += 1
        return True

    def use(self, name: str, made: Any) -> None:
        """Ask an object all that it answers, for which ``made`` may hold wrong numbers."""
        PREPARED.get(name, lambda _: None)(made)
        self.read(made)
        for signature in self.all_of(name.split(".")[0]):
            owner, _, method = signature.name.rpartition(".")
            if owner == name and method != "__init__" and not is_left_out(signature.name):
                PREPARED.get(name, lambda _: None)(made)
                self.read(getattr(made, method)(*self.arguments(signature)))

    def read(self, made: Any) -> None:
        """Read all properties of an object, and of the objects of the core that it holds."""
        if type(made).__module__.startswith("pushplan._core"):
            for attribute, bound in vars(type(made)).items():
                if isinstance(bound, property):
                    self.read(getattr(made, attribute))

    def run(self, random_calls: int) -> dict[str, Any]:
        invalid = []
        for signature in self.signatures:
            if not self.call(signature):
                invalid.append(f"{signature.name}: {self.last}")
            for position, wanted in enumerate(signature.parameters):
                right = self.valid(signature.name, wanted)
                for wrong in self.wrong(signature.name, wanted, right):
                    self.call(signature, position, wrong)
        self.mutation = 0.06
        for _ in range(random_calls):
            self.call(self.signatures[self.random.integers(len(self.signatures))])
        return {
            "parameters": sum(len(signature.parameters) for signature in self.signatures),
            "results": self.results,
            "refusals": self.refusals,
            "invalid": invalid,
        }


def _with(shape: tuple[int, ...], axis: int, extent: int) -> tuple[int, ...]:
    return (*shape[:axis], extent, *shape[axis + 1 :])


def _shown(wrong: Any) -> str:
    if isinstance(wrong, np.ndarray):
        return f"{wrong.dtype}{wrong.shape} {wrong.flat[:4]}".replace("\n", " ")
    return repr(wrong)[:60]


if __name__ == "__main__":
    faulthandler.enable()
    faulthandler.dump_traceback_later(int(os.environ.get("CORE_CALLS_SECONDS", "120")), exit=True)
    if "CORE_CALLS_ANY_MEMORY" not in os.environ:  # sanitizers need more
        resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
    np.seterr(all="ignore")
    calls = int(sys.argv[2])
    print(json.dumps([Caller(room, sys.argv[3]).run(calls) for room in sys.argv[1].split(",")]))
