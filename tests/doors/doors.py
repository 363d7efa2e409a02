"""Doors for files from strangers, a good file for each, and mutations of it.

``python tests/doors/doors.py DOOR COUNT`` feeds mutations to one door and prints what it cost.
"""

from __future__ import annotations

import contextlib
import io
import json
import re
import resource
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from pushplan.world import Episode, GoalDisc, Movables, PushplanError, RobotModel, StaticMap, World

SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
TOKENS = (
    *(b"[", b"]", b"{", b"}", b":", b", ", b"\n", b"\t", b'"', b"'", b"- ", b"&a ", b"*a"),
    *(b"<<: *a", b"null", b"true", b"-1", b"0", b"1e308", b"-1e308", b"1e999", b".nan"),
    *(b"9" * 5000, b"99999999999999999999", b"0x" + b"f" * 999, b"1:1:1", b"2001-99-99", b"1e-320"),
    *(b"[" * 200, b"- " * 200, b"\x1b[2J", b"\x00", b"\xff\xfe", b"\xe2\x80\xae"),
    *(b"!!int ", b"!!bool x", b"!!float ", b"!!timestamp x", b"!!binary x", b"!!set ", b"? "),
    *(b"Infinity", b"!!python/name:os.system "),
    *(b"[[1, 2], [3]]", b"{}", b"[]", b"''", b"EOF", b"-1 -1", b"inf", b"__class__", b"\\ud800"),
)  # fmt: skip
VALUES = (b"0", b"1", b"-1", b"7", b"1e308", b"-1e308", b"1e-308", b"1e16", b"null", b"[]", b"2")


def room() -> World:
    """A small world with an object and a wall."""
    robot = RobotModel.from_outline(
        SQUARE, mass=1.0, drive="differential", max_speed=1.0, max_turn_rate=1.0
    )
    return World(
        robot=robot,
        robot_pose=np.array([2.0, 2.0, 0.0]),
        static=StaticMap.build(
            bounds=[0.0, 0.0, 12.0, 12.0], segments=[[0.0, 6.0, 3.0, 6.0]], radii=[0.1]
        ),
        movables=Movables.from_outlines([SQUARE], [[6.0, 2.0, 0.0]]),
        goal=GoalDisc(np.array([10.0, 3.0]), 1.0),
    )


def recorded() -> Episode:
    """Three instants of it."""
    return Episode(
        world=room(),
        times=np.array([0.0, 0.1, 0.2]),
        robot_poses=np.array([[2.0, 2.0, 0.0], [2.1, 2.0, 0.0], [2.2, 2.0, 0.0]]),
        object_poses=np.tile([6.0, 2.0, 0.0], (3, 1, 1)),
        success=False,
        reason="time_limit",
        actions=np.zeros((2, 2)),
        rewards=np.zeros(2),
        about={"policy": "straight"},
    )


def _world(folder: Path, ending: str) -> tuple[Path, bytes]:
    from pushplan.world import save_world

    path = folder / f"world{ending}"
    save_world(room(), path)
    return path, path.read_bytes()


def _scenarios(folder: Path) -> tuple[Path, bytes]:
    from pushplan.scenarios.scenario import Scenario, save_scenarios

    path = folder / "scenarios.yaml"
    save_scenarios([Scenario("maze", variations={"boxes": 3}, seed=s) for s in range(2)], path)
    return path, path.read_bytes()


def _episode(folder: Path, ending: str) -> tuple[Path, bytes]:
    from pushplan.cli.common import save_episode

    path = folder / f"episode{ending}"
    save_episode(recorded(), str(path))
    return path, path.read_bytes()


def _ice(folder: Path, ending: str) -> tuple[Path, bytes]:
    from pushplan.scenarios.ice_field import IceField
    from pushplan.scenarios.ice_files import save_ice

    field = IceField((SQUARE + 1.0, SQUARE + 3.0), np.array([0.0, 0.0, 5.0, 5.0]))
    path = folder / f"ice{ending}"
    if ending == ".npy":
        np.save(path, np.stack([floe for (floe,) in field.floes]))
    else:
        save_ice(field, path)
    return path, path.read_bytes()


_MAP = b"image: map.%s\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n"
_MAP += b"occupied_thresh: 0.65\nfree_thresh: 0.196\n"
_PGM = b"P2\n4 3\n255\n0 254 254 205\n0 0 254 254\n254 254 254 0\n"


def _map(folder: Path) -> tuple[Path, bytes]:
    (folder / "map.pgm").write_bytes(_PGM)
    return folder / "map.yaml", _MAP % b"pgm"


def _picture(folder: Path, ending: str) -> tuple[Path, bytes]:
    from PIL import Image

    (folder / f"{ending}.yaml").write_bytes(_MAP % ending.encode())
    path = folder / f"map.{ending}"
    Image.fromarray(np.arange(12, dtype=np.uint8).reshape(3, 4) * 20).save(path)
    return path, path.read_bytes()


_GTSP = b"""NAME: five
TYPE: GTSP
DIMENSION: 5
GTSP_SETS: 2
EDGE_WEIGHT_TYPE: EUC_2D
NODE_COORD_SECTION
1 0 0
2 1 0
3 0 1
4 5 5
5 6 5
GTSP_SET_SECTION
1 1 2 3 -1
2 4 5 -1
EOF
"""


def _training(folder: Path) -> tuple[Path, bytes]:
    from pushplan.training.policies.config import shipped_configs

    return folder / "config.yaml", shipped_configs()["maze-ppo"].read_bytes()


def _specification(folder: Path) -> tuple[Path, bytes]:
    from pushplan.learned.loading import weights_of
    from pushplan.learned.onnx_policy import read_specification

    path = weights_of("maze-sac")
    return folder / "model.pushplan.json", read_specification(path).to_json().encode()


def _sb3(folder: Path) -> tuple[Path, bytes]:
    _, text = _specification(folder)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("data", "{}")
        archive.writestr("pushplan.json", text)
    return folder / "model.zip", packed.getvalue()


_STUDY = b"""schema: pushplan-experiment/1
suites:
- maze-2d-3
- {suite: maze-2d-5, episodes: 2, seed: 40, variations: {time_limit: 5.0}}
policies:
- straight
- {policy: straight, label: wide, parameters: {spacing: 0.3}, sweep: {spacing: [0.1, 0.5]}}
episodes: 2
seed: 7
metrics: [E_nav, steps]
timeout_s: 60.0
"""


def _load(where: str) -> Callable[[Path], Any]:
    def read(path: Path) -> Any:
        module, _, name = where.partition(":")
        return attrgetter(name)(import_module(module))(path)

    return read


def _read_picture(path: Path) -> Any:
    return _load("pushplan.world:load_nav2_map")(path.with_name(f"{path.suffix[1:]}.yaml"))


def _read_episode(path: Path) -> Any:
    return _load("pushplan.cli.common:load_episode")(str(path))


def _read_specification(path: Path) -> Any:
    from pushplan.files.safe_files import read_text
    from pushplan.learned.specification import Specification

    return Specification.from_json(read_text(path, "specification"))


def _read_sb3(path: Path) -> Any:
    from pushplan.learned.sb3_policy import Sb3Policy, UntrustedError

    with contextlib.suppress(UntrustedError):  # what a good file says: it is not trusted
        Sb3Policy(path, trust=False)


def _read_name(path: Path) -> Any:
    from pushplan.imports.named_objects import load_object

    return load_object(path.read_bytes().decode("utf-8", "surrogateescape"))


def _read_variation(path: Path) -> Any:
    from pushplan.cli.common import variation

    return variation("boxes=" + path.read_bytes().decode("utf-8", "surrogateescape"))


@dataclass(frozen=True)
class Door:
    """How a good file is made in a folder, and what reads it."""

    make: Callable[[Path], tuple[Path, bytes]]
    read: Callable[[Path], Any]


_WORLD, _ICE_IN = _load("pushplan.world:load_world"), _load("pushplan.scenarios.ice_files:load_ice")
DOORS: dict[str, Door] = {
    "world-yaml": Door(lambda f: _world(f, ".yaml"), _WORLD),
    "world-json": Door(lambda f: _world(f, ".json"), _WORLD),
    "scenarios": Door(_scenarios, _load("pushplan.scenarios.scenario:load_scenarios")),
    "episode-npz": Door(lambda f: _episode(f, ".npz"), _read_episode),
    "episode-mcap": Door(lambda f: _episode(f, ".mcap"), _read_episode),
    "ice-json": Door(lambda f: _ice(f, ".json"), _ICE_IN),
    "ice-npz": Door(lambda f: _ice(f, ".npz"), _ICE_IN),
    "ice-npy": Door(lambda f: _ice(f, ".npy"), _ICE_IN),
    "map-yaml": Door(_map, _load("pushplan.world:load_nav2_map")),
    "map-pgm": Door(lambda f: _picture(f, "pgm"), _read_picture),
    "map-png": Door(lambda f: _picture(f, "png"), _read_picture),
    "map-bmp": Door(lambda f: _picture(f, "bmp"), _read_picture),
    "gtsp": Door(lambda f: (f / "five.gtsp", _GTSP), _load("pushplan.gtsp.gtsplib:read_gtsp")),
    "tour": Door(
        lambda f: (f / "five.tour", b"NAME: t\nTYPE: TOUR\nDIMENSION: 2\nTOUR_SECTION\n2\n1\n-1\n"),
        _load("pushplan.gtsp.gtsplib:read_tour"),
    ),
    "training": Door(_training, _load("pushplan.training.policies.config:read_config")),
    "specification": Door(_specification, _read_specification),
    "experiment": Door(
        lambda f: (f / "study.yaml", _STUDY), _load("pushplan.evaluation:Experiment.load")
    ),
    "sb3-zip": Door(_sb3, _read_sb3),
    "policy-name": Door(lambda f: (f / "name", b"pushplan.planners.rrt:GeometricRRT"), _read_name),
    "variation": Door(lambda f: (f / "variation", b"[1, {a: 0.5}]"), _read_variation),
}


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """One or two changes of bytes; of an archive, mostly of what is packed in it."""
    if data[:2] == b"PK" and rng.random() < 0.8:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            parts = {name: archive.read(name) for name in archive.namelist()}
        chosen = list(parts)[int(rng.integers(len(parts)))]
        parts[chosen] = _member(parts[chosen], rng)
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, part in parts.items():
                archive.writestr(name, part)
        return packed.getvalue()
    return _member(data, rng) if data[:6] == b"\x93NUMPY" else _changed(data, rng)


def _member(part: bytes, rng: np.random.Generator) -> bytes:
    """An array whose header or values are changed; text in it is changed as text."""
    if rng.random() < 0.3:
        return _changed(part, rng)
    if b"'<U" in part[:128]:
        text = str(np.lib.format.read_array(io.BytesIO(part)))
        file = io.BytesIO()
        changed = _changed(text.encode(), rng).decode("utf-8", "replace")
        np.lib.format.write_array(file, np.array(changed))
        return file.getvalue()
    header, values = part[:128], part[128:]
    if rng.random() < 0.5:
        old = [b"(3,", b"<f8", b"False", b"(2,", b"3)", b"(", b"shape"]
        new = [b"(10000000000,", b"|O", b"<U0", b"(-1,", b"|V0", b"True", b"<c16", b"((((", b"<i8"]
        header = header.replace(old[int(rng.integers(7))], new[int(rng.integers(9))], 1)[:128]
        return header.ljust(128) + values
    return header + _changed(values, rng)


def _changed(data: bytes, rng: np.random.Generator) -> bytes:
    for _ in range(int(rng.integers(1, 3))):
        at = int(rng.integers(len(data) + 1))
        end = min(len(data), at + int(rng.geometric(0.1)))
        token = TOKENS[int(rng.integers(len(TOKENS)))]
        kind = int(rng.integers(9))
        if kind == 0:
            data = data[:at] + rng.bytes(end - at) + data[end:]
        elif kind == 1:
            data = data[:at] + data[end:]
        elif kind == 2:
            data = data[:at] + data[at:end] * int(rng.integers(2, 50)) + data[end:]
        elif kind == 3:
            data = data[:at] + token + data[at:]
        elif kind >= 5:  # in place of a number, where there is one
            token = token if kind == 5 else VALUES[int(rng.integers(len(VALUES)))]
            numbers = list(re.finditer(rb"-?\d[\d.e+-]*", data))
            if numbers:
                chosen = numbers[int(rng.integers(len(numbers)))]
                data = data[: chosen.start()] + token + data[chosen.end() :]
        else:
            lines = data.splitlines(keepends=True) or [b""]
            data = data[:at] + lines[int(rng.integers(len(lines)))] + data[at:]
    return data


WRONG = (
    *("x", "", [], {}, None, float("nan"), float("inf"), 10**30, -1, 0, True, 0.5, [True]),
    *([[1], [2, 3]], [None] * 3, {"a": [1]}, [[[[[[0]]]]]], "1e999", [10**30] * 3, [1e308] * 4),
)  # fmt: skip


def swapped(data: Any) -> Iterator[Any]:
    """The data with one value of it, at any depth, in place of which stands a wrong one."""
    if isinstance(data, dict | list):
        for key, value in list(data.items() if isinstance(data, dict) else enumerate(data)):
            for other in (*WRONG, *swapped(value)):
                changed = data.copy()
                changed[key] = other
                yield changed
    yield from ([*data, data[-1]] if isinstance(data, list) and data else data,)


@dataclass
class Cost:
    """What mutations cost: worst time [s of CPU], growth of memory [MB], and the accepted ones."""

    worst: float
    grown: float
    accepted: int


def check_message(error: PushplanError) -> None:
    """One short line that a terminal shows as it is."""
    text = str(error)
    assert 0 < len(text) <= 300 and text.isprintable(), repr(text)


def feed(name: str, count: int, folder: Path, seed: int = 0) -> Cost:
    """Feed ``count`` mutations to a door; whatever it raises but `PushplanError` passes through."""
    door, rng = DOORS[name], np.random.default_rng(seed)
    path, good = door.make(folder)
    path.write_bytes(good)
    door.read(path)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    worst, accepted = 0.0, 0
    for index in range(count):
        data = mutated(good, rng)
        path.write_bytes(data)
        begin = time.process_time()
        try:
            door.read(path)
            accepted += 1
        except PushplanError as error:
            check_message(error)
        except BaseException as error:
            error.add_note(f"mutation {index} of {name}: {data[:3000]!r}")
            raise
        worst = max(worst, time.process_time() - begin)
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return Cost(worst, (after - before) / 1024, accepted)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        sys.stdout.write(json.dumps(vars(feed(sys.argv[1], int(sys.argv[2]), Path(place)))))
