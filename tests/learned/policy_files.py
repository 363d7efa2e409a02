"""Small policy files for tests."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pushplan.learned import ActionSpec, RobotSpec, Specification
from pushplan.learned.specification import METADATA_KEY
from pushplan.observation import ImageObservation, StateObservation

MAZE_ROBOT = RobotSpec("constant_speed", 0.15, 0.105, 0.8602325267042626)


def maze_specification(**changes: Any) -> Specification:
    """Of a network that sees the state of the maze and gives a turn rate."""
    fields: dict[str, Any] = {
        "tasks": ("maze",),
        "presets": ("benchmark",),
        "robot": MAZE_ROBOT,
        "control_step": 0.8,
        "observation": StateObservation(max_objects=20),
        "action": ActionSpec("turn_rate", "continuous", (1,)),
        "training": {"algorithm": "none"},
    }
    return Specification(**{**fields, **changes})


def map_specification(**changes: Any) -> Specification:
    """Of a network that gives a value for each pixel of a map."""
    channels = ("occupancy", "footprint", "robot_distance", "goal_distance")
    fields: dict[str, Any] = {
        "tasks": ("box_delivery",),
        "presets": ("benchmark",),
        "robot": None,
        "control_step": 0.2,
        "observation": ImageObservation(channels, (10.0, 10.0), (32, 32)),
        "action": ActionSpec("waypoint", "pixel_values", (32, 32), window=10.0),
    }
    return maze_specification(**{**fields, **changes})


def linear_model(specification: Specification, weights: np.ndarray, bias: float = 0.0) -> Any:
    """An ONNX model that multiplies a vector by weights (inputs, outputs)."""
    from onnx import TensorProto, helper, numpy_helper

    nodes = [
        helper.make_node("MatMul", ["seen", "weights"], ["sum"]),
        helper.make_node("Add", ["sum", "bias"], ["action"]),
    ]
    constants = [
        numpy_helper.from_array(weights.astype(np.float32), "weights"),
        numpy_helper.from_array(np.array([bias], np.float32), "bias"),
    ]
    shape = specification.observation.shape
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info("seen", TensorProto.FLOAT, ["batch", *shape])],
        [helper.make_tensor_value_info("action", TensorProto.FLOAT, ["batch", weights.shape[1]])],
        constants,
    )
    return finish(graph, specification)


def channel_model(specification: Specification, channel: int) -> Any:
    """An ONNX model whose value of a pixel is what a channel shows there."""
    from onnx import TensorProto, helper, numpy_helper

    count, rows, cols = specification.observation.shape
    pick = np.zeros((1, count, 1, 1), np.float32)
    pick[0, channel] = 1.0
    nodes = [
        helper.make_node("Cast", ["seen"], ["numbers"], to=TensorProto.FLOAT),
        helper.make_node("Conv", ["numbers", "pick"], ["map"]),
        helper.make_node("Squeeze", ["map", "axis"], ["values"]),
    ]
    constants = [
        numpy_helper.from_array(pick, "pick"),
        numpy_helper.from_array(np.array([1], np.int64), "axis"),
    ]
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info("seen", TensorProto.UINT8, ["batch", count, rows, cols])],
        [helper.make_tensor_value_info("values", TensorProto.FLOAT, ["batch", rows, cols])],
        constants,
    )
    return finish(graph, specification)


def finish(graph: Any, specification: Specification | None, opsets: Any = None) -> Any:
    """A model of a graph, with its specification."""
    from onnx import helper

    opsets = opsets or [helper.make_opsetid("", 17)]
    model = helper.make_model(graph, opset_imports=opsets, ir_version=8)
    if specification is not None:
        helper.set_model_props(model, {METADATA_KEY: specification.to_json()})
    return model


def save(model: Any, path: Path) -> Path:
    """Write a model."""
    path.write_bytes(model.SerializeToString())
    return path


def turning(path: Path, turn: float = 0.25, **changes: Any) -> Path:
    """A maze policy that always turns the same."""
    specification = maze_specification(**changes)
    size = specification.observation.shape[0]
    return save(linear_model(specification, np.zeros((size, 1)), turn), path)
