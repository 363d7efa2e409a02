"""Pictures and films in files."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from pushplan.imports.on_demand import need
from pushplan.world import InvalidInputError
from pushplan.world.checks import number

Frame = NDArray[np.uint8]
ENDINGS = (".png", ".gif", ".mp4")


def save_image(path: str | Path, frame: Frame) -> None:
    """Write one (H, W, 3) picture to a ``.png`` file.

    Raises:
        InvalidInputError: if the ending is another one, or the file cannot be written.
    """
    path = _checked(path, (".png",))
    try:
        Image.fromarray(frame).save(path)
    except OSError as error:
        raise InvalidInputError(f"cannot write {path}: {error}") from error


def save_animation(path: str | Path, frames: Iterable[Frame], fps: float = 20.0) -> None:
    """Write (H, W, 3) frames of one size to a ``.gif`` or ``.mp4`` file; ``.png`` keeps the last.

    Args:
        path: the file.
        frames: at least one picture; they may come from a generator.
        fps: frames a second.

    Raises:
        InvalidInputError: if the ending is unknown, there is no frame, or the file cannot be
            written.
    """
    path = _checked(path, ENDINGS)
    fps = number("fps", fps, low=0.1, high=240.0)
    pictures = iter(frames)
    first = next(pictures, None)
    if first is None:
        raise InvalidInputError("an animation needs at least one frame, got none")
    try:
        ending = path.suffix.lower()
        if ending == ".mp4":
            _write_mp4(path, first, pictures, fps)
        elif ending == ".gif":
            _write_gif(path, first, pictures, fps)
        else:
            for last in pictures:
                first = last
            save_image(path, first)
    except OSError as error:
        raise InvalidInputError(f"cannot write {path}: {error}") from error


def _write_gif(path: Path, first: Frame, rest: Iterable[Frame], fps: float) -> None:
    # one palette for all frames, from a few of them, keeps flat colours from flickering
    frames = [first, *rest]
    palette = Image.fromarray(np.concatenate(frames[:: max(1, len(frames) // 8)])).quantize(255)
    head, *tail = (
        Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE)
        for frame in frames
    )
    head.save(path, save_all=True, append_images=tail, duration=round(1000.0 / fps), loop=0)


def _write_mp4(path: Path, first: Frame, rest: Iterable[Frame], fps: float) -> None:
    height, width = first.shape[:2]
    # players want even sides and this pixel format, which is the default
    output = ["-crf", "20", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2"]
    path.open("wb").close()  # raises a plain error, which ffmpeg would print
    film = need("imageio_ffmpeg").write_frames(
        str(path), (width, height), fps=fps, quality=None, macro_block_size=1, output_params=output
    )
    with contextlib.closing(film):
        film.send(None)
        for frame in itertools.chain([first], rest):
            film.send(np.ascontiguousarray(frame))


def _checked(path: str | Path, endings: tuple[str, ...]) -> Path:
    path = Path(path)
    if path.suffix.lower() not in endings:
        raise InvalidInputError(f"a picture file ends in {' or '.join(endings)}, got {path.name!r}")
    if not path.parent.is_dir():
        raise InvalidInputError(f"the folder of {path} does not exist")
    return path
