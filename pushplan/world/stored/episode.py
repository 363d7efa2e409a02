"""A recorded run: everything that is needed to compute any metric later."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from pushplan.errors import InvalidInputError, SchemaError
from pushplan.files.safe_files import MAX_BYTES, known_keys, parse_json, read_npz
from pushplan.world.checked_fields import CheckedFields, Shape
from pushplan.world.checks import (
    ArrayRecord,
    BoolArray,
    FloatArray,
    array,
)
from pushplan.world.scene import World
from pushplan.world.stored.recorded_plans import RecordedPlans
from pushplan.world.stored.world_files import world_from_dict, world_to_dict

SCHEMA = "pushplan-episode/1"
_ARRAYS = (
    "times",
    "robot_poses",
    "object_poses",
    "completed",
    "actions",
    "rewards",
    "act_times_s",
    "plan_times_s",
)
_PLANS = {f"plans_{field.name}": field.name for field in fields(RecordedPlans)}

Numbers = Annotated[FloatArray, Shape(None)]
_none = partial(np.zeros, 0)


@dataclass(frozen=True, eq=False)
class Episode(ArrayRecord, CheckedFields):
    """Record of an episode from start to end, whoever recorded it.

    Args:
        world: the start.
        times: (T + 1,) instants at which poses were recorded [s], increasing.
        robot_poses: (T + 1, 3) x, y [m], theta [rad].
        object_poses: (T + 1, K, 3), in the order of ``world.movables``; an object that has left
            the floor keeps its last pose.
        success: the task's goal was reached.
        reason: why the episode ended, such as ``"goal"``, ``"wall"`` or ``"time_limit"``.
        completed: (K,) True where the sub-task of an object was done; all false by default.
        actions: (S, A) what was sent to the environment in each of its S steps.
        rewards: (S,) reward of each step.
        act_times_s: (S,) wall-clock time of each call of the policy [s].
        plan_times_s: (P,) wall-clock time of each planning call [s].
        about: who ran what: policy, scenario, seed, versions; JSON values only.
        plans: what the policy meant to do; None if it does not show its plans.

    Raises:
        InvalidInputError: if shapes disagree or a value is not finite.
    """

    field_prefix = "episode."

    world: World
    times: Annotated[FloatArray, Shape("T")]
    robot_poses: Annotated[FloatArray, Shape("T", 3)]
    object_poses: FloatArray
    success: bool
    reason: str
    completed: BoolArray | None = None
    actions: Annotated[FloatArray, Shape(None, None)] = field(
        default_factory=lambda: np.zeros((0, 0))
    )
    rewards: Numbers = field(default_factory=_none)
    act_times_s: Numbers = field(default_factory=_none, compare=False)
    plan_times_s: Numbers = field(default_factory=_none, compare=False)
    about: Mapping[str, Any] = field(default_factory=dict, compare=False)
    plans: RecordedPlans | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        length = len(self.times)
        count = len(self.world.movables)
        put = object.__setattr__  # the class is frozen
        if length == 0 or (np.diff(self.times) <= 0.0).any():
            raise InvalidInputError("episode.times must hold at least one instant and increase")
        poses = np.asarray(self.object_poses)
        if count == 0 and poses.size == 0:  # an empty list has the wrong shape
            poses = np.zeros((length, 0, 3))
        put(self, "object_poses", array("episode.object_poses", poses, (length, count, 3)))
        done = self.completed
        if done is None:
            done = np.zeros(count, dtype=bool)
        put(self, "completed", array("episode.completed", done, (count,), dtype=np.bool_))
        if self.plans is not None and (self.plans.moved >= count).any():
            raise InvalidInputError(f"plans.moved must hold indices of {count} objects")

    def world_at(self, index: int) -> World:
        """The scene at recorded instant ``index``."""
        return self.world.moved(
            robot_pose=self.robot_poses[index],
            robot_twist=(0.0, 0.0, 0.0),  # not recorded
            movable_poses=self.object_poses[index],
            time=float(self.times[index]),
        )

    def save(self, path: str | Path) -> None:
        """Write to a compressed ``.npz`` file that holds no pickles.

        Raises:
            InvalidInputError: if it is larger than what `load` reads.
        """
        Path(path).write_bytes(self.to_bytes())

    def to_bytes(self) -> bytes:
        """Return the bytes that `save` writes; errors as there."""
        header = {
            "schema": SCHEMA,
            "world": world_to_dict(self.world),
            "success": self.success,
            "reason": self.reason,
            "about": dict(self.about),
        }
        arrays: dict[str, Any] = {key: getattr(self, key) for key in _ARRAYS}
        if self.plans is not None:
            arrays |= {key: getattr(self.plans, name) for key, name in _PLANS.items()}
        arrays["header"] = np.array(json.dumps(header))  # as a text: objects would be pickled
        size = sum(one.nbytes for one in arrays.values())
        if size > MAX_BYTES:  # else an episode is lost that `load` refuses later
            raise InvalidInputError(
                f"an episode of {len(self.times)} instants and {len(self.world.movables)} objects "
                f"has {size:,} bytes, {MAX_BYTES:,} are the greatest size of a file"
            )
        file = io.BytesIO()
        np.savez_compressed(file, **arrays)
        return file.getvalue()

    @classmethod
    def load(cls, path: str | Path) -> Episode:
        """Read what `save` wrote.

        Raises:
            SchemaError: if the file is missing, truncated, over a limit, or not an episode of this
                version.
        """
        arrays = read_npz(path, "episode file", ("header", *_ARRAYS), tuple(_PLANS))
        header = parse_json(str(arrays.pop("header")), f"the header of {path}")
        if not isinstance(header, dict) or header.get("schema") != SCHEMA:
            raise SchemaError(f"{path}: this pushplan reads schema {SCHEMA!r}")
        keys = ("schema", "world", "success", "reason", "about")
        known_keys(f"the header of {path}", header, keys, keys)
        plans = {name: arrays.pop(key) for key, name in _PLANS.items() if key in arrays}
        if plans:
            known_keys(
                f"the plans of {path}", plans, tuple(_PLANS.values()), tuple(_PLANS.values())
            )
        return cls(
            world=world_from_dict(header["world"]),
            success=header["success"],
            reason=header["reason"],
            about=header["about"],
            plans=RecordedPlans(**plans) if plans else None,
            **arrays,
        )
