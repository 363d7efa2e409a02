"""``pushplan ice``: make fields of broken ice, check those of others, draw them."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from pushplan.cli.common import add_command, positive, say, whole
from pushplan.cli.outputs import check_file, check_picture

if TYPE_CHECKING:
    from pushplan.scenarios import IceField

PICTURE_PX = 1000
_EXAMPLES = """\
  pushplan ice --concentration 0.3 --seed 1 --out field.json --picture field.png
  pushplan ice --concentration 0.5 --size 200x1000 --radius 12.5 --radii 6,25 --out big.npz
  pushplan ice field.json --hull --overlaps --picture field.png
"""


def add(commands: Any) -> None:
    """Add the command."""
    parser = add_command(
        commands, "ice", "generate a field of broken ice, or check one from a file", _EXAMPLES, run
    )
    parser.add_argument("--concentration", type=float, metavar="C", help="fraction of ice, 0 to 1")
    parser.add_argument("--seed", type=whole(0), default=0, help="of the field (default 0)")
    parser.add_argument(
        *("--size", "-s"),
        type=_numbers("x", 2),
        default=(12.0, 40.0),
        metavar="WxL",
        help="width and length of the water [m] (default 12x40)",
    )
    parser.add_argument(
        "--radius", type=positive, default=0.33, metavar="R", help="mean radius [m] (default 0.33)"
    )
    parser.add_argument(
        "--radii",
        type=_numbers(",", 2),
        default=(0.2, 0.6),
        metavar="R,R",
        help="least and greatest radius [m] (default 0.2,0.6)",
    )
    parser.add_argument(
        "--clumping", type=float, default=0.6, metavar="C", help="0 to 1 (default 0.6)"
    )
    parser.add_argument(
        "--keep-off",
        type=_numbers(",", 4),
        action="append",
        default=[],
        metavar="X,Y,X,Y",
        help="two corners of a rectangle that stays free [m]; may be repeated",
    )
    parser.add_argument("--check", metavar="FILE", help="read this field instead of making one")
    parser.add_argument(
        "check", nargs="?", default=argparse.SUPPRESS, metavar="FIELD", help="as --check FIELD"
    )
    parser.add_argument(
        "--hull", action="store_true", help="of a field that is read: hulls of what is not convex"
    )
    parser.add_argument(
        "--overlaps", action="store_true", help="of a field that is read: floes may overlap"
    )
    parser.add_argument("--out", metavar="FILE", help="write the field (.json or .npz)")
    parser.add_argument("--picture", metavar="FILE.png", help="draw the field")


def run(options: argparse.Namespace) -> int:
    """Make or read a field, say what it is like, write files."""
    check_file(options.out, (".json", ".npz"))
    check_picture(options.picture)
    field = _field(options)
    say(f"{len(field)} floes, concentration {100.0 * field.concentration:.2f} %")
    if len(field):
        radii = field.radii
        say(f"  radii {radii.min():.3g} to {radii.max():.3g} m, mean {radii.mean():.3g} m")
    if options.out:
        from pushplan.scenarios import save_ice

        save_ice(field, options.out)
        say(f"wrote {options.out}")
    if options.picture:
        _draw(field, options.picture)
        say(f"wrote {options.picture}")
    return 0


def _field(options: argparse.Namespace) -> IceField:
    from pushplan.scenarios import FloeSizes, generate_ice, load_ice
    from pushplan.world import InvalidInputError, stream

    if options.check:
        if options.concentration is not None:
            raise InvalidInputError("--check reads a field: leave out --concentration")
        return load_ice(options.check, hull=options.hull, overlaps=options.overlaps)
    if options.hull or options.overlaps:
        raise InvalidInputError("--hull and --overlaps go with a field to read: give its file")
    if options.concentration is None:
        raise InvalidInputError("pushplan ice needs --concentration, or --check and a file")
    least, greatest = options.radii
    return generate_ice(
        stream(options.seed, "ice"),
        bounds=(0.0, 0.0, *options.size),
        concentration=options.concentration,
        sizes=FloeSizes(mean_radius=options.radius, least=least, greatest=greatest),
        clumping=options.clumping,
        keep_off=[((x, y), (u, y), (u, v), (x, v)) for x, y, u, v in options.keep_off],
    )


def _draw(field: IceField, path: str) -> None:
    import numpy as np

    from pushplan.drawing import save_image
    from pushplan.drawing.canvas import Canvas
    from pushplan.drawing.palette import WATER_PALETTE

    canvas = Canvas(field.bounds, PICTURE_PX, WATER_PALETTE.floor)
    for corners in field.polygons:
        canvas.polygon(corners, *WATER_PALETTE.box, WATER_PALETTE.box_edge_px)
    save_image(path, np.asarray(canvas.finish()))


def _numbers(separator: str, count: int) -> Callable[[str], tuple[float, ...]]:
    """An option type: so many numbers between separators."""

    def read(text: str) -> tuple[float, ...]:
        try:
            values = tuple(float(part) for part in text.split(separator))
        except ValueError:
            values = ()
        if len(values) != count:
            example = separator.join("12345"[:count])
            raise argparse.ArgumentTypeError(
                f"must be {count} numbers like {example}, got {text!r}"
            )
        return values

    return read
