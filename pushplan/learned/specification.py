"""`Specification`: what a file with a network says about itself, observations included."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, asdict, dataclass, field, fields
from typing import Annotated, Any

from pushplan.files.safe_files import known_keys, parse_json
from pushplan.learned.features import FeatureObservation
from pushplan.learned.outputs import ActionSpec
from pushplan.observation import ImageObservation, ObservationBuilder, StateObservation
from pushplan.perception import LidarObservation
from pushplan.world import InvalidInputError, RobotModel, SchemaError
from pushplan.world.checked_fields import CheckedFields, Each, NonNegativeFloat, PositiveFloat
from pushplan.world.checks import choice

FORMAT = "pushplan-policy/1"
METADATA_KEY = "pushplan"
"""Key of the ONNX metadata, and stem of the zip member, that holds the specification as JSON."""
LONGEST_TEXT = 1_000_000
_KEYS = ("format", "tasks", "presets", "robot", "control_step", "observation", "action", "training")
_TOLERANCE = 1e-6

KINDS: dict[str, type[Any]] = {
    "image": ImageObservation,
    "state": StateObservation,
    "features": FeatureObservation,
    "lidar": LidarObservation,
}
GREATEST_SIZE = 2**24
"""Elements of an observation that a file may ask for."""


@dataclass(frozen=True)
class RobotSpec(CheckedFields):
    """The robot that a network drives; a policy refuses another one.

    Args:
        drive: a `pushplan.world.Drive`.
        max_speed: [m/s].
        max_turn_rate: [rad/s].
        radius: circumscribed radius of the footprint [m].
    """

    field_prefix = "robot."

    drive: str
    max_speed: PositiveFloat
    max_turn_rate: PositiveFloat
    radius: PositiveFloat

    @classmethod
    def of(cls, robot: RobotModel) -> RobotSpec:
        """Of a robot."""
        return cls(
            robot.drive.value, robot.max_speed, robot.max_turn_rate, robot.circumscribed_radius
        )

    def difference(self, robot: RobotModel) -> str | None:
        """Describe how a robot differs from this one; None if it does not."""
        other = RobotSpec.of(robot)
        for name, mine in asdict(self).items():
            theirs = getattr(other, name)
            same = mine == theirs if name == "drive" else close(mine, theirs)
            if not same:
                return f"{name} {mine!r} where the robot {robot.name!r} has {theirs!r}"
        return None


@dataclass(frozen=True)
class Specification(CheckedFields):
    """Observation and action of a network, and what it was made for.

    Args:
        tasks: names of the tasks; empty for any.
        presets: names of their presets; empty for any.
        robot: which robot it drives; None for any.
        control_step: time between two commands to the robot [s]; 0 for any.
        observation: builder of what it sees.
        action: what its output means.
        training: facts for people and model cards; JSON values, never interpreted.
    """

    tasks: Annotated[tuple[str, ...], Each(least=0)]
    presets: Annotated[tuple[str, ...], Each(least=0)]
    robot: RobotSpec | None
    control_step: NonNegativeFloat
    observation: ObservationBuilder
    action: ActionSpec
    training: Mapping[str, Any] = field(default_factory=dict)

    def to_json(self) -> str:
        """One line of JSON."""
        data = {
            "format": FORMAT,
            "tasks": list(self.tasks),
            "presets": list(self.presets),
            "robot": None if self.robot is None else asdict(self.robot),
            "control_step": self.control_step,
            "observation": builder_to_dict(self.observation),
            "action": asdict(self.action),
            "training": dict(self.training),
        }
        return json.dumps(data, allow_nan=False)

    @classmethod
    def from_json(cls, text: str) -> Specification:
        """Read what `to_json` gives.

        Raises:
            SchemaError, InvalidInputError: if it is no such text, or a value is wrong.
        """
        if len(text) > LONGEST_TEXT:
            raise SchemaError(f"the specification is longer than {LONGEST_TEXT} characters")
        data = parse_json(text, "the specification")
        if not isinstance(data, dict) or data.get("format") != FORMAT:
            found = data.get("format") if isinstance(data, dict) else data
            raise SchemaError(
                f"the specification has format {found!r:.60}, this version reads {FORMAT!r}"
            )
        known_keys("the specification", data, _KEYS, tuple(k for k in _KEYS if k != "training"))
        training = data.get("training", {})
        robot = data["robot"]
        if robot is not None:
            robot = from_mapping(RobotSpec, "robot", robot)
        if not isinstance(training, dict):
            raise SchemaError(f"training must be a mapping, got {training!r:.60}")
        return cls(
            tasks=data["tasks"],
            presets=data["presets"],
            robot=robot,
            control_step=data["control_step"],
            observation=builder_from_dict(data["observation"]),
            action=from_mapping(ActionSpec, "action", data["action"]),
            training=training,
        )


def close(a: float, b: float) -> bool:
    """Return True if two lengths, speeds or times are equal within the tolerance."""
    return math.isclose(a, b, rel_tol=_TOLERANCE)


def from_mapping(kind: type[Any], name: str, data: Any, *, beside: Sequence[str] = ()) -> Any:
    """A dataclass from a mapping of its fields, in which lists stand for tuples.

    Args:
        kind: the dataclass.
        name: what errors call the mapping.
        data: the mapping.
        beside: keys that may be there too; they are not used.

    Raises:
        SchemaError, InvalidInputError: if a key or a value is wrong.
    """
    own = [field.name for field in fields(kind)]
    needed = [
        field.name
        for field in fields(kind)
        if field.default is MISSING and field.default_factory is MISSING
    ]
    known_keys(name, data, (*beside, *own), needed)
    return kind(
        **{
            key: tuple(value) if isinstance(value, list) else value
            for key, value in data.items()
            if key in own
        }
    )


def builder_to_dict(builder: ObservationBuilder) -> dict[str, Any]:
    """JSON values from which `builder_from_dict` makes the builder again.

    Raises:
        InvalidInputError: if it is a builder of one's own, which a file cannot describe.
    """
    for kind, known in KINDS.items():
        if type(builder) is known:
            data = asdict(builder) | {"shape": builder.shape}  # type: ignore[call-overload]
            own: dict[str, Any] = json.loads(json.dumps(data))  # tuples as lists
            return {"kind": kind, **own, "dtype": builder.dtype.name}
    raise InvalidInputError(
        f"an observation in a file is one of {', '.join(KINDS)}, got {type(builder).__name__}"
    )


def builder_from_dict(data: Mapping[str, Any]) -> ObservationBuilder:
    """The builder of an observation.

    ``shape`` and ``dtype`` may be given, and must then be what the builder has.

    Raises:
        SchemaError, InvalidInputError: if a key or a value is wrong.
    """
    if not isinstance(data, Mapping) or "kind" not in data:
        raise SchemaError(f"observation must be a mapping with a kind, got {data!r:.80}")
    kind = KINDS[choice("observation kind", data["kind"], tuple(KINDS))]
    builder: ObservationBuilder = from_mapping(
        kind, "observation", data, beside=("kind", "shape", "dtype")
    )
    if math.prod(builder.shape) > GREATEST_SIZE:
        raise InvalidInputError(f"an observation of shape {builder.shape} is too large")
    shape = data.get("shape", builder.shape)
    dtype = data.get("dtype")
    if isinstance(shape, list):
        shape = tuple(shape)
    if shape != builder.shape or dtype not in (None, builder.dtype.name):
        raise SchemaError(
            f"observation says {dtype!s:.40} of shape {shape!s:.60}, but {data['kind']} "
            f"with these options is {builder.dtype.name} of shape {builder.shape}"
        )
    return builder
