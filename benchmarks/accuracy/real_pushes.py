"""Real pushes by a point finger, against what the contact model predicts of them.

    python -m benchmarks.accuracy.real_pushes FOLDER [--seeds 20] [--train 10] [--simulators]

FOLDER holds .npz files of pushes of one block each (Zhou, Paolini, Bagnell and Mason, "A convex
polynomial force-motion model for planar sliding", ICRA 2016, converted): `object_before` and
`object_after` (N, 3), `robot` (sum, 4) t, x, y, yaw, `robot_offsets` (N + 1,), and
`support_points_body` (3, 2), or none where the block lies flat. The error of a push is
|dx| + 0.05 m |dtheta| of its end, and each cell is a mean over pushes [mm].
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.reporting import command_line, head, origin, row, write
from pushplan.interaction import ContactParameters, ObservedPush, QuasiStatic, identify
from pushplan.interaction.interaction_model import InteractionModel
from pushplan.world import RobotModel
from pushplan.world.checks import FloatArray

BLOCK = np.array([[-0.05, -0.05], [0.10, -0.05], [-0.05, 0.10]])
FINGER_RADIUS_M = 0.001
FINGER_CORNERS = 16
TURN_M = 0.05  # weight of the heading in the error
CART_M = 0.2  # side of the cart that carries the finger in MuJoCo
AHEAD_M = 0.5  # of the finger ahead of its axle

Predictor = Callable[[ObservedPush], FloatArray]


def finger() -> RobotModel:
    """The point finger, as a robot."""
    angles = np.arange(FINGER_CORNERS) * 2.0 * np.pi / FINGER_CORNERS
    outline = FINGER_RADIUS_M * np.column_stack([np.cos(angles), np.sin(angles)])
    return RobotModel.from_outline(
        outline, mass=1.0, drive="differential", max_speed=0.05, max_turn_rate=10.0, name="finger"
    )


def read_pushes(path: Path) -> tuple[list[ObservedPush], FloatArray]:
    """The pushes of a file, and the points that the block stands on (K, 2) [m]."""
    with np.load(path) as data:
        robot = finger()
        rows = np.split(data["robot"][:, 1:3], data["robot_offsets"][1:-1])
        pushes = []
        for places, before, after in zip(
            rows, data["object_before"], data["object_after"], strict=True
        ):
            heading = math.atan2(*(places[-1] - places[0])[::-1])  # any: the finger is round
            poses = np.column_stack([places, np.full(len(places), heading)])
            pushes.append(ObservedPush(robot, BLOCK, poses, before, after))
        return pushes, data["support_points_body"].reshape(-1, 2)


def error(push: ObservedPush, end: FloatArray) -> float:
    """Distance of a predicted pose from the observed one [mm]."""
    turn = math.remainder(float(end[2] - push.object_after[2]), math.tau)
    return 1e3 * (math.dist(end[:2], push.object_after[:2]) + TURN_M * abs(turn))


def mean_error(pushes: Sequence[ObservedPush], predict: Predictor) -> float:
    """Mean error of a predictor [mm]."""
    return float(np.mean([error(push, predict(push)) for push in pushes]))


def stays(push: ObservedPush) -> FloatArray:
    """The object does not move."""
    return push.object_before


def sticks(push: ObservedPush) -> FloatArray:
    """The object moves along with the finger from the first contact on, without turning."""
    path = push.robot_poses[:, :2]
    touched = QuasiStatic().sweep(push.world(), push.robot_poses).object_poses[:, 0]
    moved = (touched != touched[0]).any(axis=1)
    first = int(moved.argmax()) if moved.any() else len(path) - 1
    return np.append(push.object_before[:2] + path[-1] - path[first], push.object_before[2])


def raw(model: InteractionModel) -> Predictor:
    """Predicts by a model along the path as it was recorded."""
    return lambda push: model.sweep(push.world(), push.robot_poses).object_poses[-1, 0]


def smooth(parameters: ContactParameters) -> Predictor:
    """Predicts by parameters, with their correction of the finger."""
    robot = parameters.fitted(finger())
    return lambda push: replace(push, robot=robot).predicted(parameters.model())


def cart() -> RobotModel:
    """A heavy cart with the finger ahead of it, as MuJoCo needs wheels to drive."""
    side = 0.5 * CART_M
    chassis = np.array([[-side, -side], [side, -side], [side, side], [-side, side]])
    tip = finger().parts[0] + [AHEAD_M, 0.0]
    return RobotModel(
        parts=(chassis, tip),
        mass=30.0,
        drive="differential",
        max_speed=0.05,
        max_turn_rate=1.0,
        wheel_separation=CART_M,
        name="cart",
    )


def simulated(name: str, friction: float) -> Predictor:
    """Predicts by a simulator."""
    from pushplan.envs import RolloutInteraction
    from pushplan.envs.simulators.base import Materials, Solids

    solids = Solids(0.05, 0.05, 0.05, 0.05, 0.02)
    model = RolloutInteraction(name, Materials(robot_object=friction, solids=solids))

    def predict(push: ObservedPush) -> FloatArray:
        path = push.path().copy()
        if name == "mujoco":
            ahead = np.column_stack([np.cos(path[:, 2]), np.sin(path[:, 2])])
            path[:, :2] -= AHEAD_M * ahead
            push = replace(push, robot=cart(), robot_poses=path)
        return model.sweep(push.world(), path).object_poses[-1, 0]

    return predict


@dataclass(frozen=True)
class PushSet:
    """Rows of the tables for one file."""

    errors: dict[str, float]  # [mm] by predictor
    found: list[ContactParameters]  # one for each split, without knowledge of the support
    scale: float  # of the gyration, from the support
    seconds: float  # of CPU for one identification


def measure(path: Path, splits: int, train: int, simulators: bool) -> PushSet:
    """Predict the pushes of a file in every way."""
    pushes, points = read_pushes(path)
    blind = ContactParameters()
    known = ContactParameters.prior(outline=BLOCK, support=points if len(points) else "evenly")
    scale = known.gyration_scale
    errors = {
        "no motion": mean_error(pushes, stays),
        "moves with the finger": mean_error(pushes, sticks),
        "`QuasiStatic` by default, recorded path": mean_error(pushes, raw(QuasiStatic())),
        "friction 0.5, gyration of the support, recorded path": mean_error(
            pushes, raw(QuasiStatic(0.5, scale))
        ),
        "prior, support unknown": mean_error(pushes, smooth(blind)),
        "prior, known support": mean_error(pushes, smooth(known)),
    }
    if simulators:
        for name in ("pymunk", "mujoco"):
            errors[f"{name}, friction of the prior"] = mean_error(
                pushes, simulated(name, blind.friction)
            )
    train = max(1, min(train, len(pushes) // 2))
    rows: list[list[float]] = []
    found = []
    seconds = 0.0
    rng = np.random.default_rng(0)
    for _ in range(splits):
        order = rng.permutation(len(pushes))
        seen = [pushes[k] for k in order[:train]]
        rest = [pushes[k] for k in order[train:]]
        spent = time.process_time()
        parameters = identify(seen)
        seconds += (time.process_time() - spent) / splits
        informed = identify(seen, known)
        found.append(parameters)
        predictors = (smooth(parameters), smooth(informed))
        rows.append([mean_error(rest, predict) for predict in predictors])
    names = (
        f"identified from {train}",
        f"identified from {train}, known support",
    )
    errors |= dict(zip(names, np.mean(rows, axis=0).tolist(), strict=True))
    errors["identified from all and tested on them"] = mean_error(pushes, smooth(identify(pushes)))
    return PushSet(errors, found, scale, seconds)


def main() -> None:
    parser = command_line(__doc__, seeds=20)
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="of the .npz files")
    parser.add_argument("--train", type=int, default=10, help="pushes to identify from; default 10")
    parser.add_argument("--simulators", action="store_true", help="Pymunk and MuJoCo as well")
    options = parser.parse_args()
    files = sorted(options.folder.glob("*.npz"))
    if not files:
        parser.error(f"{options.folder} holds no .npz file")
    sets = {
        path.stem: measure(path, options.seeds, options.train, options.simulators) for path in files
    }
    write(origin(), "")
    head("error [mm]", *sets, "mean")
    for name in next(iter(sets.values())).errors:
        cells = [one.errors.get(name, math.nan) for one in sets.values()]
        row(name, *(f"{value:.2f}" for value in (*cells, np.mean(cells))))
    write("")
    head("identified", *sets)
    row("gyration of the support", *(f"{one.scale:.2f}" for one in sets.values()))
    for k, name in enumerate(("friction", "scale of the gyration")):
        values = [np.array([p.values[k] for p in one.found]) for one in sets.values()]
        stated = [np.mean([p.deviations[k] for p in one.found]) for one in sets.values()]
        row(name, *(f"{v.mean():.2f}" for v in values))
        row("its deviation among splits", *(f"{v.std():.2f}" for v in values))
        row("as stated", *(f"{s:.2f}" for s in stated))
    row(
        "overlap [mm]",
        *(f"{1e3 * np.mean([p.overlap for p in s.found]):.2f}" for s in sets.values()),
    )
    row("CPU of an identification [ms]", *(f"{1e3 * one.seconds:.0f}" for one in sets.values()))


if __name__ == "__main__":
    main()
