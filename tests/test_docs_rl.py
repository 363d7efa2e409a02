"""Every block of the page on reinforcement learning runs on its own, trained for one rollout."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import gymnasium
import pytest

import pushplan.envs
from pushplan.cli.parser import build_parser

PAGE = (Path(__file__).parents[1] / "docs" / "rl.md").read_text("utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


def script(word: str) -> str:
    """The one Python block with this word, with a training of one rollout."""
    (found,) = [text for kind, text in BLOCKS if kind == "python" and word in text]
    return found.replace("100_000", "1024")


def run(text: str, folder: Path) -> str:
    (folder / "script.py").write_text(text)
    done = subprocess.run(
        [sys.executable, "script.py"], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_an_environment_is_made(tmp_path: Path) -> None:
    run(script('boxes=5, observation="state")'), tmp_path)


def test_the_table_of_spaces_is_true() -> None:
    rows = re.findall(r"^\| (`pushplan/.*?) \| (.*?) \| (.*?) \| (.*?) \|$", PAGE, re.MULTILINE)
    seen = set()
    for ids, image, others, actions in rows:
        for name in re.findall(r"`(.*?)`", ids):
            env = gymnasium.make(name).unwrapped
            task = env.task
            assert tuple(re.findall(r"`(\w+)`", actions)) == task.actions
            (size,) = re.findall(r"`\w+` \((\d),\)", actions)
            assert env.action_space.shape == (int(size),)
            named = tuple(re.findall(r"`(\w+)`", others))
            if image.startswith("("):
                assert task.observations == ("image", *named)
                assert str(env.observation_space.shape) == image
            else:
                assert task.observations == named
                assert f"{env.observation_space.shape}" in others
            seen.add(name)
    assert seen == set(pushplan.envs.registry.GYM_IDS)


@pytest.mark.slow
def test_policies_that_ship_are_compared(tmp_path: Path) -> None:
    text = script("maze-sac").replace("episodes=2", "episodes=1")
    assert "maze-ppo" in run(text, tmp_path)


@pytest.mark.slow
def test_a_film_is_recorded(tmp_path: Path) -> None:
    pytest.importorskip("moviepy")
    run(script("RecordVideo"), tmp_path)
    assert list((tmp_path / "videos").glob("*.mp4"))


@pytest.mark.slow
@pytest.mark.learn
def test_a_network_is_trained_and_becomes_a_row(tmp_path: Path) -> None:
    pytest.importorskip("stable_baselines3")
    run(script("SubprocVecEnv"), tmp_path)
    run(script("TransformReward"), tmp_path)
    assert list((tmp_path / "runs" / "tensorboard").rglob("events*"))
    (command,) = [text for kind, text in BLOCKS if kind == "bash" and "bench" in text]
    program, *arguments = shlex.split(command.replace("20", "1"))
    assert program == "pushplan" and build_parser().parse_args(arguments)
    subprocess.run(
        [sys.executable, "-m", program, *arguments, "--workers", "1"], cwd=tmp_path, check=True
    )
    rows = (tmp_path / "runs" / "rl" / "results.csv").read_text().splitlines()
    assert {row.split(",")[0] for row in rows[1:]} == {"straight", "maze-ppo", "model"}
