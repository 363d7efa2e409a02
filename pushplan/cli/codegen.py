"""``pushplan codegen``: write a controller as C."""

from __future__ import annotations

import argparse
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

from pushplan.cli.common import add_command, say
from pushplan.cli.outputs import check_directory

if TYPE_CHECKING:
    from pushplan.world import World

_EXAMPLES = """\
  pushplan codegen tracking-mpc --out controller
  pushplan codegen pushing-mpc --world room.yaml --box 3 --set horizon=12 --out controller
"""


def add(commands: Any) -> None:
    """Add the command."""
    parser = add_command(
        commands, "codegen", "write a controller as C without dependencies", _EXAMPLES, run
    )
    parser.add_argument("controller", metavar="CONTROLLER", help="pushing-mpc or tracking-mpc")
    parser.add_argument("--out", required=True, metavar="DIR", help="folder to write to")
    parser.add_argument(
        "--world",
        metavar="WORLD.yaml",
        help="world file with robot and box (default: a TurtleBot3 Burger, a box of 8 cm)",
    )
    parser.add_argument("--box", type=int, metavar="ID", help="of the box (default: the first)")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a parameter of the controller, e.g. horizon=12",
    )


def run(options: argparse.Namespace) -> int:
    """Write the files and name them."""
    import numpy as np

    from pushplan.codegen import CONTROLLERS, write_pushing_mpc, write_tracking_mpc
    from pushplan.control import MpcConfig
    from pushplan.planners.pushing import PushingConfig
    from pushplan.world import UnknownNameError, load_world, turtlebot3_burger

    check_directory(options.out)
    if options.controller not in CONTROLLERS:
        raise UnknownNameError("controller", options.controller, CONTROLLERS)
    world = load_world(options.world) if options.world else None
    robot = world.robot if world else turtlebot3_burger("pusher")
    if options.controller == "tracking-mpc":
        files = write_tracking_mpc(options.out, robot, _changed(MpcConfig(), options.set))
    else:
        side = 0.04 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        outline = _outline(world, options.box) if world else side
        config = _changed(PushingConfig(), options.set)
        files = write_pushing_mpc(options.out, robot, outline, config)
    for file in files:
        say(f"wrote {file}")
    return 0


def _outline(world: World, box: int | None) -> Any:
    from pushplan.world import InvalidInputError

    ids = world.movables.ids.tolist()
    if not ids or (box is not None and box not in ids):
        raise InvalidInputError(f"the world has no box {box}, it has {ids}")
    return world.movables.outline(0 if box is None else ids.index(box))


def _changed(config: Any, changes: list[str]) -> Any:
    """A configuration with changes NAME=VALUE."""
    from pushplan.world import InvalidInputError, UnknownNameError
    from pushplan.world.safe_files import parse_yaml

    known = {field.name for field in fields(config)} - {"parameters"}
    friction = {field.name for field in fields(getattr(config, "parameters", config))}
    values: dict[str, Any] = {}
    inner: dict[str, Any] = {}
    for change in changes:
        name, sign, text = change.partition("=")
        if not sign:
            raise InvalidInputError(f"--set takes NAME=VALUE, got {change!r}")
        if name not in known | friction:
            raise UnknownNameError("parameter", name, sorted(known | friction))
        (values if name in known else inner)[name] = parse_yaml(
            text, f"{text!r:.60} of --set {name}"
        )
    if inner:
        values["parameters"] = replace(config.parameters, **inner)
    return replace(config, **values)
