"""One short episode of each original environment, driven through the policy server."""

from __future__ import annotations

import os
import subprocess
import sys
import venv
from pathlib import Path

import pytest

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
        (line,) = [line for line in done.stdout.splitlines() if line.startswith(f"| `{policy}`")]
        success, efficiency = (cell.split() for cell in line.split("|")[2:4])
        assert 0.0 <= float(success[0]) <= 1.0 and 0.0 <= float(efficiency[0]) <= 1.2
        assert line in Path(f"{out}.md").read_text(encoding="utf-8")
    first, second = (next(out.iterdir()).read_text(encoding="utf-8") for out in outs)
    poses = [text.partition('"robot_poses"')[2].partition('"act_s"')[0] for text in (first, second)]
    assert poses[0] and poses[0] == poses[1]


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
    assert [row[3].strip() for row in rows] == ["original", "ours", "ours, its settings"]
    theirs, _, alike = (float(row[7].split()[0]) for row in rows)
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
        (("--scenes", "maze-4"), "no scene 'maze-4'"),
        (("--seeds", "5-3"), "FIRST-LAST"),
        (("--seeds", "x"), "FIRST-LAST"),
    ],
)
def test_bad_arguments(arguments: tuple[str, str], words: str) -> None:
    done = bench("--python", "nothing", *arguments)
    assert done.returncode == 2 and words in done.stderr
