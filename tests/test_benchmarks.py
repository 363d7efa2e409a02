"""Benchmarks are listed, answer --help, and are named on the page that shows their figures."""

from __future__ import annotations

import re
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

from pushplan.interaction import ObservedPush, QuasiStatic
from pushplan.planners.arguments import check_pusher
from pushplan.world import Movables, Receptacle, StaticMap, World, area_clearing_robot

ROOT = Path(__file__).parents[1]
BENCHMARKS = ROOT / "benchmarks"
INDEX = (BENCHMARKS / "README.md").read_text(encoding="utf-8")
LINES = re.findall(r"^\| .+ \| `(.+?)` \| \d+ \| (.+) \|$", INDEX, re.MULTILINE)
SUBJECTS = [command.split()[2] for command, _ in LINES]
MODULES = [subject for subject in SUBJECTS if not subject.endswith(".yaml")]


def test_the_index_lists_every_benchmark() -> None:
    modules = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts)
        for path in BENCHMARKS.rglob("*.py")
        if "command_line(" in path.read_text() and path.stem != "reporting"
    }
    studies = {
        path.relative_to(ROOT).as_posix()
        for path in BENCHMARKS.rglob("*.yaml")
        if "schema: pushplan-experiment/1" in path.read_text()
    }
    assert sorted(SUBJECTS) == sorted(modules | studies)


@pytest.mark.parametrize("name", MODULES)
def test_help_says_what_a_benchmark_measures(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", [name, "--help"])
    monkeypatch.setattr(sys, "path", list(sys.path))
    with pytest.raises(SystemExit) as ended:
        runpy.run_module(name, run_name="__main__")
    assert ended.value.code == 0
    assert f"python -m {name}" in capsys.readouterr().out


def test_the_pages_of_the_index_name_the_command() -> None:
    for (_, pages), subject in zip(LINES, SUBJECTS, strict=True):
        for page in re.findall(r"\]\((.+?)\)", pages):
            assert subject in (BENCHMARKS / page).read_text(encoding="utf-8"), page


def test_a_call_path_stays_in_the_files_whose_functions_get_the_world() -> None:
    from benchmarks.accuracy.call_path import CallPath

    square = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
    world = World(
        robot=area_clearing_robot(),
        robot_pose=(-1.25, 0.0, 0.0),
        static=StaticMap.build(bounds=(-9.0, -9.0, 9.0, 9.0)),
        movables=Movables.from_outlines([square], [(0.0, 0.0, 0.2)]),
        goal=Receptacle([(4.5, 4.5), (5.5, 4.5), (5.5, 5.5), (4.5, 5.5)]),
    )
    path = CallPath()
    sys.setprofile(path)
    for _ in range(2):
        check_pusher(world)
        check_pusher(world)
        QuasiStatic().bodies(world)
        world.movables.outline_world(0)
    sys.setprofile(None)
    assert path.stays == [
        "planners/arguments.py",
        "interaction/quasi_static.py",
    ]


def test_real_pushes_reads_files_of_any_number_and_length(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from benchmarks.accuracy import real_pushes

    lengths = (40, 900, 300, 5)
    rng = np.random.default_rng(0)
    befores = []
    afters = []
    robots = []
    for rows in lengths:
        x = np.linspace(-0.052, -0.052 + 1e-4 * rows, rows)
        y = np.linspace(0.03, 0.03 + 2e-5 * rows, rows)
        path = np.column_stack([x, y, np.zeros(rows)])
        before = np.zeros(3)
        push = ObservedPush(real_pushes.finger(), real_pushes.BLOCK, path, before, before)
        befores.append(before)
        afters.append(push.predicted(QuasiStatic(0.4, 1.2)) + 1e-4 * rng.standard_normal(3))
        robots.append(np.column_stack([np.arange(rows), np.round(path, 4)]))
    np.savez(
        tmp_path / "flat.npz",
        object_before=befores,
        object_after=afters,
        robot=np.concatenate(robots),
        robot_offsets=np.append(0, np.cumsum(lengths)),
        support_points_body=np.zeros((0, 2)),
    )
    monkeypatch.setattr(sys, "argv", ["real_pushes", str(tmp_path), "--seeds", "1"])
    real_pushes.main()
    rows_of = dict(re.findall(r"^\| ([^|]+) \| ([\d.]+) \|", capsys.readouterr().out, re.MULTILINE))
    assert float(rows_of["identified from all and tested on them"]) < float(rows_of["no motion"])
    assert float(rows_of["gyration of the support"]) == pytest.approx(0.90, abs=0.01)


def barn_like(folder: Path, *, closed: bool) -> None:
    """Write a world with a row of cylinders across the way, with a gap unless it is closed."""
    y = np.arange(0.075, 9.6, 0.15)
    x = np.arange(-4.425, 0.0, 0.15)
    middle = x if closed else x[np.abs(x + 3.2) > 0.6]
    lines = [(np.full(len(y), side), y) for side in (-4.425, -0.075)]
    lines += [(middle, np.full(len(middle), 7.0))]
    places = np.column_stack([np.concatenate(line) for line in zip(*lines, strict=True)])
    cylinders = np.column_stack([places, np.full(len(places), 0.075)])
    np.savez(folder / "worlds.npz", cylinders=cylinders, offsets=[0, len(cylinders)], first=7)
    path = np.column_stack([np.full(30, 15), np.arange(30)])
    np.savez(folder / "paths.npz", path_7=path)


def test_real_maps_plans_in_worlds_and_maps_and_checks_the_plans(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from benchmarks.accuracy import real_maps

    barn_like(tmp_path, closed=False)
    pixels = np.full((40, 60), 254, np.uint8)
    pixels[:25, 30:32] = 0
    (tmp_path / "room.pgm").write_bytes(b"P5 60 40 255\n" + pixels.tobytes())
    rest = "resolution: 0.1\norigin: [-1, 2, 0.3]\nnegate: 0\nfree_thresh: 0.2\n"
    (tmp_path / "room.yaml").write_text(f"image: room.pgm\noccupied_thresh: 0.65\n{rest}")
    (tmp_path / "torn.yaml").write_text(f"image: none.pgm\noccupied_thresh: 0.65\n{rest}")
    folder = str(tmp_path)
    argv = ["real_maps", "--barn", folder, "--nav2", folder, "--pairs", "1"]
    monkeypatch.setattr(sys, "argv", argv)
    real_maps.main()
    rows = [line.split(" | ") for line in capsys.readouterr().out.splitlines()[3:]]
    found = [(re.split(r"\W+", name)[1], *cells[:4]) for name, *cells in rows[1:-1]]
    assert found == [
        ("BARN", "`straight`", "0 of 1", "1", "0"),
        ("BARN", "`kinodynamic-rrt`", "1 of 1", "0", "0"),
        ("BARN", "`push-aware`", "1 of 1", "0", "0"),
        ("room", "`straight`", "0 of 2", "2", "0"),
        ("room", "`kinodynamic-rrt`", "2 of 2", "0", "0"),
        ("room", "`push-aware`", "2 of 2", "0", "0"),
    ]
    assert rows[-1][0] == "| torn"
    assert rows[-1][1].startswith("refused: ")


def test_real_maps_finds_a_plan_that_touches_an_obstacle(tmp_path: Path) -> None:
    from benchmarks.accuracy import real_maps
    from pushplan.world import Plan, jackal

    barn_like(tmp_path, closed=True)
    case = next(iter(real_maps.barn_cases(tmp_path, jackal())))
    end = np.array([-2.25, 12.5, np.pi / 2.0])

    def plan(*poses: object) -> Plan:
        times = np.arange(len(poses), dtype=float)
        return Plan(times, np.array(poses), np.ones(len(poses)), np.zeros(len(poses)), 1.0)

    start = case.world.robot_pose
    assert real_maps.fault_of(case, plan(start, end), True) == "collides"
    assert real_maps.fault_of(case, plan(start, end), False) == "collides"
    assert real_maps.fault_of(case, plan(start, start), True) == "ends elsewhere"
    assert real_maps.fault_of(case, plan(end, end), True) == "starts elsewhere"
    quarter = plan([1, 0, np.pi / 2], [0, 1, np.pi])
    places, headings = real_maps.poses_between(quarter, 0.5)
    assert np.allclose(places, np.exp(1j * (headings - np.pi / 2)))
