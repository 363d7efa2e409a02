"""What docs/serve.md shows is what happens."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from served import HELLO, Raw, maze, served

from pushplan.metrics import compute
from pushplan.serving import ServerLimits, world_feed
from pushplan.serving.messages import REQUESTS
from pushplan.serving.session import SETTINGS
from pushplan.world import Episode, world_to_dict

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "serve.md").read_text("utf-8")
(EXCHANGE,) = re.findall(r"```\n(> .*?)```", PAGE, re.DOTALL)
LINES = [(line[0], line[2:]) for line in EXCHANGE.splitlines()]
REQUESTED = [text for who, text in LINES if who == ">"]
REPLIED = [json.loads(text) for who, text in LINES if who == "<"]


def same(got: Any, shown: Any) -> bool:
    if isinstance(shown, dict):
        return got.keys() == shown.keys() and all(
            same(got[key], shown[key]) for key in shown if key != "version"
        )
    return got == (pytest.approx(shown) if type(shown) is float else shown)


def test_the_exchange_happens_as_it_is_shown(tmp_path):
    with served("straight", tmp_path) as server, Raw(server) as raw:
        for request, shown in zip(REQUESTED, REPLIED, strict=True):
            got = raw.ask(request.encode())
            assert same(got, shown), (got, shown)


@pytest.mark.skipif(shutil.which("g++") is None, reason="needs g++")
def test_the_client_in_another_language_compiles_and_talks(tmp_path):
    code = ROOT / "examples" / "cpp" / "serve_client.cpp"
    build = ["g++", "-std=c++17", "-Wall", "-Werror", code, "-o", "client"]
    subprocess.run(build, cwd=tmp_path, check=True)
    with served("straight", tmp_path) as server:
        done = subprocess.run(
            [tmp_path / "client", server.address.removeprefix("unix:")],
            input="\n".join(REQUESTED),
            capture_output=True,
            text=True,
            check=True,
        )
    replies = [json.loads(line) for line in done.stdout.splitlines()]
    assert all(same(*pair) for pair in zip(replies, REPLIED, strict=True))


@pytest.mark.parametrize("boxes", [(), ((4, 9, 0.3), (10, 12, 0.0))])
def test_an_episode_that_a_client_writes_is_scored_as_one_of_ours(boxes, tmp_path):
    world = maze(boxes)
    times = [0.0, 0.5, 1.0, 1.5]
    robot = [[*world.robot_pose[:2], 1.5 + 0.1 * k] for k in range(4)]
    robot[-1][1] += 1.0
    objects = np.repeat(world.movables.poses[None], 4, axis=0)
    objects[2:, :, 0] += 0.3
    (code,) = (one for one in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "savez" in one)
    assert "pushplan." not in code and "import pushplan" not in code
    names: dict[str, Any] = {}
    exec(code, names)
    file = tmp_path / "episode.npz"
    given = json.loads(json.dumps(world_to_dict(world)))
    names["save_episode"](file, given, times, robot, objects.tolist(), True, waits=[0.1, 0.2, 0.3])
    found = Episode.load(file)
    ours = Episode(world, np.array(times), np.array(robot), objects, True, "goal")
    assert compute(found) == pytest.approx(compute(ours), nan_ok=True) and compute(found)
    assert found.act_times_s.tolist() == [0.1, 0.2, 0.3] and found.completed.tolist() == [
        False for _ in boxes
    ]


def test_the_page_names_every_request_key_setting_and_limit():
    for kind, (required, optional) in REQUESTS.items():
        assert f"| `{kind}` |" in PAGE
        assert all(f"`{key}`" in PAGE for key in (*required, *optional))
    assert all(f"`{key}`" in PAGE for key in SETTINGS)
    limits = ServerLimits()
    assert (limits.clients, limits.message_bytes, limits.message_s, limits.idle_s) == (
        *(8, 4_000_000, 10.0, 600.0),
    )
    assert f"{world_feed.MAX_OBJECTS:,}" in PAGE and f"{world_feed.WIDEST:,.0f} radii" in PAGE
    assert (world_feed.LEAST, world_feed.HEAVIEST, world_feed.FASTEST) == (1e-9, 1e12, 1e6)
    assert world_feed.FARTHEST == 1e6 and HELLO["protocol"] in PAGE
