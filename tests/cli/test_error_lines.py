"""What the commands say where a policy, an option or a file of a user is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from pushplan.cli import main

pytestmark = pytest.mark.usefixtures("empty_figures")
ROOM = Path(__file__).parents[2] / "examples" / "room.yaml"
MINE = """\
import heapq
import math

import numpy as np

from pushplan.planners import ShortestPath
from pushplan.world import Plan, PlanResult, PlanStats, PlanStatus


class Good:
    def plan(self, world, *, stop=None, rng=None):
        return ShortestPath().plan(world)


class Raises:
    def plan(self, world, *, stop=None, rng=None):
        return {}["oops"]  # line 17


class Sometimes:
    calls = 0

    def plan(self, world, *, stop=None, rng=None):
        Sometimes.calls += 1
        raise RuntimeError("first" if Sometimes.calls == 2 else "again")  # the dry run is 1


class Nothing:
    def plan(self, world, *, stop=None, rng=None):
        return None


class NotANumber:
    def plan(self, world, *, stop=None, rng=None):
        poses = np.full((2, 3), math.nan)
        return PlanResult(
            PlanStatus.SOLVED,
            Plan(np.arange(2.0), poses, np.ones(2), np.zeros(2), 1.0),  # line 38
            PlanStats(0.0),
        )


class Straight:
    def reset(self, world, rng):
        pass

    def act(self, world, observation):
        return [0.0]


class NeedsArgument:
    def __init__(self, needed):
        pass


class RaisesWhenMade:
    def __init__(self):
        ShortestPath(1, 2, 3, 4, 5, 6, 7, 8, 9)  # line 58


class Interrupted(Straight):
    calls = 0

    def reset(self, world, rng):
        Interrupted.calls += 1
        if Interrupted.calls == 3:  # the dry run is 1
            raise KeyboardInterrupt


class Empty:
    pass
"""


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "torn.py").write_text("def x(:\n")
    (tmp_path / "lost.py").write_text("import no_such_library\n")
    monkeypatch.chdir(tmp_path)
    return "mine.py"


def test_bench_says_why_policies_failed_and_why_episodes_did_not_succeed(
    mine: str, capsys: pytest.CaptureFixture[str]
) -> None:
    names = ("Good", "Raises", "Nothing", "NotANumber", "Straight")
    given = ",".join(f"{mine}:{name}" for name in names)
    options = ["--episodes", "1", "--workers", "0", "--out", "run"]
    assert main(["bench", "maze-2d-3", "--policies", given, *options]) == 1
    said = capsys.readouterr()
    lines = [line for line in said.err.splitlines() if "failed" in line]
    told, files = zip(*(line.split("; traceback: ") for line in lines), strict=True)
    assert told == (
        "Raises: 1 of 1 failed: KeyError: 'oops' (mine.py:17)",
        "Nothing: 1 of 1 failed: InvalidInputError: what the planner returns must be a PlanResult, "
        "got None",
        "NotANumber: 1 of 1 failed: InvalidInputError: plan.poses must be finite, got nan at index "
        "(0, 0) (mine.py:38)",
    )
    assert all("Traceback" in Path(file).read_text() for file in files)
    assert "Straight without success: 1 wall" in said.out.splitlines()
    assert "Good without success" not in said.out


def test_the_most_frequent_of_several_reasons(
    mine: str, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--episodes", "3", "--workers", "0", "--out", "run"]
    assert main(["bench", "maze-2d-3", "--policies", f"s={mine}:Sometimes", *options]) == 1
    said = capsys.readouterr().err.splitlines()[-1]
    assert said.startswith("s: 3 of 3 failed, 2 of these: RuntimeError: again (mine.py:25); trace")


@pytest.mark.parametrize(
    ("policy", "code", "said"),
    [
        ("mine.py:Raises", 1, "policy 'Raises' failed: KeyError: 'oops' (mine.py:17)"),
        ("m=mine.py:Nothing", 1, "policy 'm' failed: InvalidInputError: what the planner returns"),
        ("mine.py:NeedsArgument", 2, "policy 'NeedsArgument' cannot be made: TypeError: "),
        ("mine.py:RaisesWhenMade", 2, "(mine.py:58)"),
        ("mine.py:Empty", 2, "policy 'Empty' cannot be made: a Empty has neither the methods"),
        ("torn.py:X", 2, "'X' cannot be made: SyntaxError: invalid syntax (torn.py, line 1)"),
        ("lost.py:X", 2, "No module named 'no_such_library' (lost.py:1)"),
        ("mine.py:good", 2, "unknown name in mine.py 'good'; did you mean 'Good'? (valid: "),
        (
            "mine.py",
            2,
            "'mine.py' names no class or function: give mine.py:Good or mine.py:Raises ",
        ),
        ("torn.py", 2, "SyntaxError: invalid syntax (torn.py, line 1)"),
    ],
)
def test_run_and_bench_say_the_same_in_one_line(
    policy: str, code: int, said: str, mine: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", "maze-2d-3", "--policy", policy]) == code
    told = capsys.readouterr().err
    assert told.count("\n") == 1 and said in told
    assert "heapq" not in told and "Empty" not in told.partition("names no class")[2]
    options = ["--episodes", "1", "--workers", "0", "--out", "run"]
    assert main(["bench", "maze-2d-3", "--policies", policy, *options]) == code
    if code == 2:
        assert capsys.readouterr().err == told


def test_plan_takes_a_planner_from_a_file(mine: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", str(ROOM), "--planner", "mine.py:Good", "--out", "plan.json"]) == 0
    assert "Good: path_only" in capsys.readouterr().out
    assert '"planner": "Good"' in Path("plan.json").read_text()
    for planner, code, said in (
        ("mine.py:Raises", 1, "planner 'Raises' failed: KeyError: 'oops' (mine.py:17)"),
        ("mine.py:Nothing", 1, "planner 'Nothing' failed: InvalidInputError: what the planner"),
        ("mine.py:NeedsArgument", 2, "planner 'NeedsArgument' cannot be made: TypeError: "),
        ("mine.py:Straight", 2, "'Straight' is a policy, not a planner: give it to 'pushplan run'"),
        ("gtsp-mpc", 2, "'gtsp-mpc' is a policy, not a planner: give it to 'pushplan run'"),
        ("mine.py:Empty", 2, "planner 'Empty' is a Empty, which has no method plan"),
        ("gtsp-mpcs", 2, "unknown planner 'gtsp-mpcs'"),
    ):
        assert main(["plan", str(ROOM), "--planner", planner]) == code
        told = capsys.readouterr().err
        assert told.startswith(f"pushplan: {said}") and told.count("\n") == 1


def test_after_ctrl_c_finished_episodes_are_told_of(
    mine: str, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["bench", "maze-2d-3", "--policies", f"{mine}:Interrupted"]
    options = ["--episodes", "3", "--workers", "0", "--out", "run"]
    assert main([*command, *options]) == 130
    (told,) = (one for one in capsys.readouterr().err.splitlines() if one.startswith("stopped"))
    assert "1 finished episode is kept in run; the same command goes on with the others" in told
    assert "'pushplan report run' makes the tables" in told
    assert main(["report", "run"]) == 0
    assert main([*command, *options]) == 0
    assert "1 of 3 episodes are there already" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "required: COMMAND; see 'pushplan --help'"),
        (["benhc"], "unknown command 'benhc'; did you mean 'bench'?"),
        (["bench", "smoke"], "required: --policies; see 'pushplan bench --help'"),
        (["bench", "smoke", "--policies", "straight", "--no-open"], "unknown option '--no-open'"),
        (["bench", "smoke", "--polices", "x"], "'--polices'; did you mean '--policies'?"),
        (["bench", "smoke", "--policies", "straight", "--only", "x"], "see 'pushplan bench --help"),
        (["dataset", "export", "more"], "see 'pushplan dataset"),
        (
            ["run", "smoke", "more", "--policy", "straight"],
            "unrecognized arguments: more; ",
        ),
        (["plan", "a", "--planner", "b", "--deadline", "0"], "--deadline: must be positive"),
    ],
)
def test_a_wrong_option_is_one_line_that_names_the_help_of_the_command(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    told = capsys.readouterr().err
    assert told.startswith("pushplan: ") and told.count("\n") == 1
    assert said in told and "--help'" in told


def test_a_world_file_is_no_suite(capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--episodes", "1", "--workers", "0"]
    assert main(["bench", str(ROOM), "--policies", "straight", *options]) == 2
    told = capsys.readouterr().err
    assert f"give its folder as '{ROOM.parent}/'" in told
    assert f"--task room --set world_file={ROOM}" in told
    for given in (ROOM, ROOM.parent):
        assert main(["run", str(given), "--policy", "straight"]) == 2
        assert "--task room --set world_file=FILE" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("pose: [1.0, 1.0,", "pose: [.nan, 1.0,", "robot.pose must be finite, got nan"),
        (
            "kind: disc",
            "kind: circle",
            "'circle' (valid: clearance_area, disc, line, objects, pose, receptacle)",
        ),
        ("mass: 1.07", "mass: .inf", "robot.mass must lie in (0, inf), got inf"),
        ("mass: 1.07", "mass: -1.07", "robot.mass must lie in (0, inf), got -1.07"),
        ("mass: 0.5 ", "mass: .nan ", "movables[0].mass must lie in (0, inf), got nan"),
    ],
)
def test_a_world_file_is_refused_by_its_own_keys(
    old: str, new: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = ROOM.read_text()
    assert old in text
    file = tmp_path / "room.yaml"
    file.write_text(text.replace(old, new, 1))
    assert main(["plan", str(file), "--planner", "straight"]) == 2
    assert f": {said}" in (told := capsys.readouterr().err) or said in told
    assert "did you mean" not in told and "world." not in told


def test_a_folder_that_takes_no_files_is_refused_before_the_work(
    capsys: pytest.CaptureFixture[str],
) -> None:
    if not Path("/proc/self").is_dir():
        pytest.skip("needs a folder of the kernel")
    for command in (
        ["bench", "maze-2d-3", "--policies", "straight", "--out", "/proc/run"],
        ["run", "maze-2d-3", "--policy", "straight", "--out", "/proc/episode.npz"],
        ["plan", str(ROOM), "--planner", "straight", "--render", "/proc/plan.png"],
    ):
        assert main(command) == 2
        said = capsys.readouterr()
        assert said.out == "" and said.err.count("\n") == 1
        assert "/proc takes no new files" in said.err and "Errno" not in said.err
