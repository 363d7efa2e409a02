"""Figures for documents: a scale in metres, a legend of what they show, files that repeat."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_drawing import SIDES, SIZE, SQUARE, hall, plan_of, scene

from pushplan.drawing import Panel, add_strips, draw_figure, draw_world, legend_of, save_figure
from pushplan.drawing.figure import COLUMN
from pushplan.world import InvalidInputError, Movables, World

PATH = np.array([[1.0, 1.0], [2.0, 1.5], [3.0, 3.0]])


def labels(*panels: Panel) -> list[str]:
    return [text.get_text() for text in draw_figure(*panels).legends[0].get_texts()]


def test_the_legend_has_what_is_shown_once() -> None:
    world = scene()
    kinds = ["robot", "goal", "wall", "movable object", "object on casters"]
    assert labels(Panel(world)) == kinds
    driving = Panel(world, plan=plan_of(world), trail=PATH)
    assert labels(Panel(world), driving) == [*kinds, "plan", "predicted push", "path so far"]
    held = Movables.from_outlines([SQUARE], [[2, 5, 0.2]], fixed=[True])
    still = World(world.robot, world.robot_pose, world.static, held, world.goal)
    assert labels(Panel(still, pushes=[PATH]))[2:] == [
        *("wall", "fixed object", "on the way to a push")
    ]


def test_axes_are_in_metres_and_nothing_lies_over_them() -> None:
    figure = draw_figure(Panel(scene(), title="one"), Panel(scene(height=20.0), title="two"))
    figure.draw_without_rendering()
    first, second = figure.axes
    assert first.get_xlim() == (0.0, 10.0) and second.get_ylim() == (0.0, 20.0)
    assert (first.get_xlabel(), first.get_ylabel()) == ("x [m]", "y [m]")
    legend = figure.legends[0].get_window_extent()
    page = figure.bbox
    for axes in figure.axes:
        box = axes.get_tightbbox()
        assert box.y0 > legend.y1 and box.y1 <= page.y1 and box.x0 >= 0.0
        assert axes.get_aspect() == 1.0


@pytest.mark.parametrize(("width", "height"), SIDES)
def test_a_figure_holds_all_of_a_world_on_one_page(width: float, height: float) -> None:
    world, plan = hall(width, height)
    figure = draw_figure(Panel(world, plan=plan, title="plan"))
    figure.draw_without_rendering()
    (axes,) = figure.axes
    assert (axes.get_xlim(), axes.get_ylim()) == ((0.0, width), (0.0, height))
    page, box = figure.bbox, axes.get_tightbbox()
    assert figure.legends[0].get_window_extent().y1 < box.y0
    assert page.x0 <= box.x0 and box.x1 <= page.x1 and box.y1 <= page.y1
    assert figure.get_figwidth() <= COLUMN and figure.get_figheight() < 2.0 * COLUMN


def test_files_repeat_and_letters_stay_letters(tmp_path: Path) -> None:
    world = scene()
    for ending, begin in ((".svg", b"<?xml"), (".pdf", b"%PDF"), (".png", b"\x89PNG")):
        files = [tmp_path / f"{name}{ending}" for name in ("ab" if ending == ".svg" else "a")]
        for file in files:
            panel = Panel(world, plan=plan_of(world), pushes=[PATH])
            save_figure(file, draw_figure(panel), title="a plan")
        assert files[0].read_bytes() == files[-1].read_bytes()
        assert files[0].read_bytes().startswith(begin)
    text = (tmp_path / "a.svg").read_text()
    assert ">movable object</text>" in text and "a plan" in text


def test_what_makes_no_figure_is_refused(tmp_path: Path) -> None:
    for made in (
        lambda: draw_figure(),
        lambda: draw_figure(Panel(scene()), width_in=0.0),
        lambda: draw_figure(Panel(scene(), pushes=[np.zeros((3, 1))])),
        lambda: save_figure(tmp_path / "a.bmp", draw_figure(Panel(scene()))),
        lambda: save_figure(tmp_path / "none" / "a.svg", draw_figure(Panel(scene()))),
    ):
        with pytest.raises(InvalidInputError):
            made()


@pytest.mark.parametrize("size", [SIZE, 151])
def test_strips_cover_nothing(size: int) -> None:
    world = scene()
    picture = draw_world(world, size_px=size)
    framed = add_strips(picture, ["1.0 s", "I 0.9"], legend_of(world, plan=True, trail=True))
    height, width = picture.shape[:2]
    assert framed.shape[1] == width and framed.shape[0] % 2 == 0
    tops = [
        y
        for y in range(framed.shape[0] - height)
        if np.array_equal(framed[y : y + height], picture)
    ]
    assert len(tops) == 1 and 0 < tops[0]
    for strip in (framed[: tops[0]], framed[tops[0] + height :]):
        assert (strip < 128).any()
