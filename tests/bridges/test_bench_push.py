"""The original environments: short episodes of ours and of policies for their interface."""

from __future__ import annotations

import importlib
import importlib.util
import json
import os
import re
import runpy
import subprocess
import sys
import venv
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pymunk
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pushplan.envs import make
from pushplan.scenarios import load_scenarios

ROOT = Path(__file__).parents[2]
BRIDGE = ROOT / "bridges" / "bench_push"
SCENES = ("maze-5", "ship_ice-20", "area_clearing-clear_env", "box_delivery-small_empty")


def bench(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(BRIDGE / "bench.py"), *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT)


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> str:
    """An interpreter that has the original environments."""
    if given := os.environ.get("BENCHNPIN_PYTHON"):
        return given
    folder = tmp_path_factory.mktemp("benchnpin")
    venv.create(folder, with_pip=True)
    own = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    found = str(folder / "bin" / "python")
    for what in (["-r", str(BRIDGE / "requirements.txt")], ["--no-deps", "benchnpin==0.1.1"]):
        command = [found, "-m", "pip", "install", "--quiet", *what]
        done = subprocess.run(command, capture_output=True, text=True, env=own)
        if done.returncode:
            pytest.skip(f"benchnpin cannot be installed: {done.stderr.strip()[-300:]}")
    return found


@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES)
def test_a_short_episode_is_scored_by_both(python: str, scene: str, tmp_path: Path) -> None:
    arguments = ["--python", python, "--scenes", scene, "--seeds", "3-3", "--most-steps", "40"]
    policy = "straight" if scene.startswith(("maze", "ship")) else "greedy"
    outs = [tmp_path / "a", tmp_path / "b"]
    for out in outs:
        done = bench(
            *arguments, "--policies", policy, "--out", str(out), "--page", str(out) + ".md"
        )
        assert done.returncode == 0, done.stderr
        assert "original: benchnpin 0.1.1" in done.stdout
        lines = [line for line in done.stdout.splitlines() if f"| `{policy}` | 3 |" in line]
        assert len(lines) == 2  # by their code, and by ours
        success, efficiency = (cell.split() for cell in lines[0].split("|")[4:6])
        assert 0.0 <= float(success[0]) <= 1.0 and 0.0 <= float(efficiency[0]) <= 1.2
        assert "\n".join(lines[:1]) in Path(f"{out}.md").read_text(encoding="utf-8")
    first, second = (next(out.iterdir()).read_text(encoding="utf-8") for out in outs)
    poses = [text.partition('"robot_poses"')[2].partition('"act_s"')[0] for text in (first, second)]
    assert poses[0] and poses[0] == poses[1]


THEIRS = """
class Spinner:
    images = False

    def reset(self):
        self.calls = 0

    def act(self, observation, **facts):
        self.calls += 1
        assert len(facts["robot_pos"]) == 3 and len(facts["obstacles"]) == 5
        return 12.0 if self.calls > 2 else 0.0  # its limit is 1
"""


@pytest.mark.slow
def test_a_policy_for_their_interface_keeps_within_limits(python: str, tmp_path: Path) -> None:
    (tmp_path / "spinner.py").write_text(THEIRS, encoding="utf-8")
    policy = f"theirs:{tmp_path / 'spinner.py'}:Spinner"
    arguments = ["--scenes", "maze-5", "--seeds", "3-3", "--most-steps", "10"]
    done = bench("--python", python, *arguments, "--policies", policy, "--out", str(tmp_path / "a"))
    assert done.returncode == 0, done.stdout + done.stderr
    (file,) = (tmp_path / "a").iterdir()
    episode = json.loads(file.read_text(encoding="utf-8"))
    rates = np.diff(np.array(episode["robot_poses"])[:, 2]) / np.diff(episode["times"])
    assert rates[1] == 0.0 and rates[-1] == pytest.approx(np.pi / 30.0)


BRITTLE = """
import os, pathlib
from pushplan.world import Twist

class Brittle:
    def reset(self, world, rng):
        count = pathlib.Path({marker!r})
        resets = len(count.read_text()) if count.exists() else 0
        count.write_text("x" * (resets + 1))
        if resets == 1:
            raise ValueError("out of ideas")
        if resets == 2:
            os._exit(1)

    def act(self, world, observation):
        return Twist(world.robot.max_speed, 0.0)
"""


@pytest.mark.slow
def test_a_failure_loses_no_finished_episode(python: str, tmp_path: Path) -> None:
    source = BRITTLE.format(marker=str(tmp_path / "resets"))
    (tmp_path / "brittle.py").write_text(source, encoding="utf-8")
    arguments = ["--scenes", "maze-5", "--seeds", "3-5", "--most-steps", "5"]
    arguments += ["--policies", f"{tmp_path / 'brittle.py'}:Brittle", "--out", str(tmp_path / "a")]
    done = bench("--python", python, *arguments)
    assert done.returncode == 1
    assert "seed 4: the policy failed: reset: " in done.stdout and "out of ideas" in done.stdout
    assert "seed 5: the policy server has gone" in done.stdout
    assert "1 of 3 episodes" in done.stdout
    (file,) = (tmp_path / "a").iterdir()
    first = file.read_text(encoding="utf-8")
    file.write_text(first + first[:50], encoding="utf-8")  # as after a kill
    done = bench("--python", python, *arguments)
    assert done.returncode == 0, done.stdout + done.stderr
    lines = file.read_text(encoding="utf-8").splitlines()
    assert lines[0] == first.strip()
    assert [json.loads(line)["seed"] for line in lines] == [3, 4, 5]


def test_tables_replace_what_stands_between_the_marks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(BRIDGE))
    tables = importlib.import_module("tables")
    page = tmp_path / "page.md"
    begin = "<!-- tables of bench.py maze -->"
    page.write_text(f"# Page\n\n{begin}\nold\n{tables.END}\n\nMore.\n", encoding="utf-8")
    for text in ("new\n", "newer\n"):
        tables.write(page, text, "bench.py maze")
        expected = f"# Page\n\n{begin}\n{text}{tables.END}\n\nMore.\n"
        assert page.read_text(encoding="utf-8") == expected
    tables.write(page, "ice\n", "bench.py ship_ice")
    text = page.read_text(encoding="utf-8")
    assert text.startswith(expected) and "ice" in text


def test_scores_are_kept_and_gone_on_with(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BRIDGE))
    episodes = importlib.import_module("episodes")
    names = ["theirs_S", "theirs_E", "theirs_I", "ours_S", "ours_E", "ours_I", "ours_work"]
    one = dict.fromkeys([*names, "median_ms", "longest_ms"], 0.5)
    run = episodes.Run("benchnpin 0.1.1", "maze", "5", "straight", range(4), 20_000, {1: one})
    file = tmp_path / "scores.csv"
    episodes.keep(run, file)
    more = episodes.Run(
        "benchnpin 0.1.1", "maze", "5", "straight", range(4), 20_000, {3: {**one, "ours_E": 0.25}}
    )
    episodes.keep(more, file)
    found = episodes.recalled(
        episodes.Run("benchnpin 0.1.1", "maze", "5", "straight", range(4), 20_000), file
    )
    assert found.missing == [0, 2] and found.values("ours_E") == {1: 0.5, 3: 0.25}
    newer = episodes.Run("benchnpin 0.2.0", "maze", "5", "straight", range(4), 20_000)
    assert not episodes.recalled(newer, file).episodes
    (tmp_path / "a.jsonl").write_text(json.dumps({"seed": 1, "most_steps": 20_000}) + "\n")
    assert list(episodes.whole(tmp_path / "a.jsonl", run)) == [1]
    with pytest.raises(
        SystemExit, match=r"has episodes of benchnpin 0\.1\.1, not of benchnpin 0\.2"
    ):
        episodes.whole(tmp_path / "a.jsonl", newer)
    other = episodes.recalled(
        episodes.Run("benchnpin 0.1.1", "maze", "5", "straight", range(4), 10), file
    )
    assert not other.episodes
    file.write_text("seed\n1\n", encoding="utf-8")
    with pytest.raises(ValueError, match="must have the columns original, scene"):
        episodes.recalled(run, file)


def test_modules_of_a_checkout_are_read_under_the_name_that_is_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(BRIDGE))
    monkeypatch.syspath_prepend(str(tmp_path / "installed"))
    monkeypatch.setattr(sys, "meta_path", list(sys.meta_path))
    installed = tmp_path / "installed" / "benchnpin"
    planners = tmp_path / "checkout" / "benchpush" / "planners"
    for folder in (installed, planners):
        folder.mkdir(parents=True)
    (installed / "__init__.py").write_text("", encoding="utf-8")
    (installed / "tools.py").write_text("ANSWER = 42\n", encoding="utf-8")
    (planners / "tree.py").write_text("from benchpush.tools import ANSWER\n", encoding="utf-8")
    checkout = importlib.import_module("checkout")
    with pytest.raises(SystemExit, match="not the original's"):
        checkout.take_from(tmp_path)
    checkout.take_from(tmp_path / "checkout")
    assert importlib.import_module("benchnpin.planners.tree").ANSWER == 42


CONFIG = """
robot:
  min_r: {radius}
sim:
  gravity: !!python/tuple [0, 0]
goal_radius: 1
render:
  show: {show}
"""


@pytest.mark.parametrize(
    ("version", "radius", "says"),
    [
        ("0.1.1", 0.6, None),
        ("", 0.6, None),
        ("0.2.0", 0.6, "is version 0.2.0, installed is benchnpin 0.1.1"),
        ("0.1.1", 0.86, "config.yaml has robot.min_r 0.86 in"),
        ("", 0.86, "0.6 in the installed benchnpin 0.1.1"),
    ],
)
def test_planners_and_environments_of_two_versions_are_not_mixed(
    version: str,
    radius: float,
    says: str | None,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.syspath_prepend(str(BRIDGE))
    versions = importlib.import_module("versions")
    checkout, package = tmp_path / "checkout", tmp_path / "benchnpin"
    place = Path("environments", "maze", "config.yaml")
    for root, own, show in ((package, 0.6, "true"), (checkout / "benchpush", radius, "false")):
        (root / place).parent.mkdir(parents=True)
        (root / place).write_text(CONFIG.format(radius=own, show=show), encoding="utf-8")
    if version:
        setup = f'setup(\n    name="benchpush",\n    version="{version}",\n)\n'
        (checkout / "setup.py").write_text(setup, encoding="utf-8")
    if says is None:
        versions.refuse_mixture(checkout, package, "benchnpin 0.1.1")
    else:
        with pytest.raises(SystemExit, match=re.escape(says)) as error:
            versions.refuse_mixture(checkout, package, "benchnpin 0.1.1")
        assert "\n" not in str(error.value)


@pytest.mark.parametrize("scene", ["DeliveryScene", "AreaScene"])
def test_planners_are_told_of_every_shape_of_a_robot(
    scene: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(BRIDGE))
    scenes = importlib.import_module("scenes")
    body = pymunk.Body(1.0, 1.0)
    shapes = {
        "robot": pymunk.Poly.create_box(body, (0.8, 0.7)),
        "front_bumper": pymunk.Poly(body, [(0.4, -0.53), (0.5, -0.53), (0.5, 0.53), (0.4, 0.53)]),
        "wheel": pymunk.Poly.create_box(body, (0.1, 0.1)),
    }
    for label, shape in shapes.items():
        shape.label = label
    held = SimpleNamespace(body=body)
    its = scenes.__dict__[scene].__new__(scenes.__dict__[scene])
    its.inner = SimpleNamespace(robot=held, agent=held)
    parts = its.parts()
    assert parts == [shapes["front_bumper"], shapes["robot"]]
    scenes.refuse_unknown("area", body, parts)
    for other in (pymunk.Circle(body, 0.3), pymunk.Poly.create_box(body, (2.0, 2.0))):
        with pytest.raises(SystemExit, match="which this bridge does not know"):
            scenes.refuse_unknown("area", SimpleNamespace(shapes={other}), parts)


def test_a_metric_that_reads_the_mass_of_boxes_finds_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BRIDGE))
    drive = importlib.import_module("drive")
    for kept in (None, 3.0):
        made = SimpleNamespace() if kept is None else SimpleNamespace(box_mass=kept)
        module = SimpleNamespace(Kind=lambda name, mass, made=made: made)
        monkeypatch.setattr(drive.importlib, "import_module", lambda name, module=module: module)
        scene = SimpleNamespace(metric="task:Kind", name="area", robot_mass=lambda: 1.0)
        assert drive.metric_of(scene).box_mass == kept


@given(
    *(st.tuples(*[st.floats(-3.0, 3.0)] * 3) for _ in range(2)),
    st.floats(0.2, 2.0),
)
def test_dubins_paths_are_the_shortest(
    start: tuple[float, ...], end: tuple[float, ...], radius: float
) -> None:
    spec = importlib.util.spec_from_file_location("dubins_paths", BRIDGE / "dubins_paths.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    path = module.shortest_path(start, end, radius)
    last = path.sample(path.path_length())
    assert np.allclose(last[:2], end[:2], atol=1e-6)
    assert np.cos(last[2] - end[2]) == pytest.approx(1.0, abs=1e-6)
    poses, distances = path.sample_many(0.1)
    assert len(poses) == len(distances) and path.path_length() - 0.1 <= max(distances, default=0.0)


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["maze-5", "area_clearing-clear_env"])
def test_the_same_start_in_both_engines(python: str, scene: str, tmp_path: Path) -> None:
    policy = "straight" if scene.startswith("maze") else "greedy"
    arguments = ["--python", python, "--scenes", scene, "--policies", policy, "--seeds", "0-0"]
    command = [sys.executable, str(BRIDGE / "engines.py"), *arguments, "--most-steps", "100"]
    done = subprocess.run(
        [*command, "--out", str(tmp_path)], capture_output=True, text=True, cwd=ROOT
    )
    assert done.returncode == 0, done.stderr
    rows = [line.split("|") for line in done.stdout.splitlines() if line.startswith("| ")][1:]
    assert [row[4].strip() for row in rows] == ["original", "ours", "ours, its settings"]
    theirs, _, alike = (float(row[8].split()[0]) for row in rows)
    assert alike == pytest.approx(theirs, rel=0.1, abs=1e-3)


@pytest.mark.slow
def test_its_ice_fields_become_scenarios(python: str, tmp_path: Path) -> None:
    own = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    arguments = ["--concentration", "20", "--fields", "4-5", "--out", str(tmp_path)]
    subprocess.run([python, str(BRIDGE / "ice.py"), *arguments], check=True, env=own)
    scenarios = load_scenarios(tmp_path / "20.yaml")
    assert [one.seed for one in scenarios] == [4, 5]
    env = make(scenarios[0], observation="state")
    env.reset(seed=4)
    masses = env.world.movables.masses
    assert 0.18 < masses.sum() / (12.0 * 38.0) < 0.22 and 240 < len(masses) < 280


@pytest.mark.slow
def test_what_is_missing_is_said() -> None:
    done = bench("--python", sys.executable, "--scenes", "maze-5")
    assert (
        done.returncode == 2 and "pip install -r bridges/bench_push/requirements.txt" in done.stderr
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--scenes", "mase-5"), "no scene 'mase-5' (valid: maze"),
        (("--scenes", "area_clearing-turning"), "clear_env_turning"),
        (("--seeds", "5-3"), "FIRST-LAST"),
    ],
)
def test_bad_arguments(
    arguments: tuple[str, str],
    words: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(sys, "path", list(sys.path))  # the script adds its folder
    monkeypatch.setattr(sys, "argv", ["bench.py", "--python", "nothing", *arguments])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(BRIDGE / "bench.py"), run_name="__main__")
    assert ended.value.code == 2 and words in capsys.readouterr().err
