"""``pushplan ice``: make fields of broken ice, check those of others, draw them."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from pushplan.cli.common import say_written, tell
from pushplan.cli.output_files import check_file, check_picture

if TYPE_CHECKING:
    from pushplan.scenarios import IceField

PICTURE_PX = 1000


def run(options: argparse.Namespace) -> int:
    """Make or read a field, say what it is like, write files."""
    check_file(options.out, (".json", ".npz"))
    check_picture(options.picture)
    field = _field(options)
    lines = [f"{len(field)} floes, concentration {100.0 * field.concentration:.2f} %"]
    about: dict[str, float] = {"floes": len(field), "concentration": float(field.concentration)}
    if len(field):
        radii = {"min": field.radii.min(), "max": field.radii.max(), "mean": field.radii.mean()}
        about |= {f"radius_{name}_m": float(value) for name, value in radii.items()}
        lines.append("  radii {min:.3g} to {max:.3g} m, mean {mean:.3g} m".format(**radii))
    if options.out:
        from pushplan.scenarios import save_ice

        save_ice(field, options.out)
    if options.picture:
        _draw(field, options.picture)
    tell(options, about, *lines)
    say_written(options, options.out, options.picture)
    return 0


def _field(options: argparse.Namespace) -> IceField:
    from pushplan.scenarios import FloeSizes, generate_ice, load_ice
    from pushplan.world import InvalidInputError, stream

    if path := options.field or options.check:
        if options.concentration is not None:
            raise InvalidInputError("--check reads a field: leave out --concentration")
        return load_ice(path, hull=options.hull, overlaps=options.overlaps)
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
    from pushplan.world.convex_shapes import rings_of

    canvas = Canvas(field.bounds, PICTURE_PX, WATER_PALETTE.floor)
    fill, edge = WATER_PALETTE.box
    for parts in field.floes:
        for part in parts:
            canvas.polygon(part, fill, fill)
        for ring in rings_of(parts):
            canvas.polygon(ring, None, edge, WATER_PALETTE.box_edge_px / canvas.unit)
    save_image(path, np.asarray(canvas.finish()))
