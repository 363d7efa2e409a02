"""Tables of the pages are those that `benchmarks/scores/tables.py` makes of stored episodes."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.scores.tables import main
from pushplan.evaluation import bench

ROOT = Path(__file__).parents[1]
EXPERIMENT = """\
schema: pushplan-experiment/1
suites: [maze-2d-3, {suite: maze-2d-5, policies: [random]}]
policies: [straight, random]
episodes: 2
seed: 7
"""
PAGE = """\
Before.

<!-- table: small; columns: success, E, work, step -->
<!-- end of the table -->

<!-- table: small; suites: *-3; differences: straight -->
<!-- end of the table -->
After.
"""


@pytest.mark.slow
def test_the_pages_have_what_the_stored_episodes_give(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--check"]) == 0, capsys.readouterr().out


def test_a_run_is_taken_written_and_checked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stored = tmp_path / "benchmarks" / "experiments" / "small.csv"
    page = tmp_path / "docs" / "page.md"
    for path, text in ((stored.with_suffix(".yaml"), EXPERIMENT), (page, PAGE)):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    root = ["--root", str(tmp_path)]

    def call(*arguments: str) -> tuple[int, str]:
        code = main([*root, *arguments])
        return code, capsys.readouterr().out

    code, said = call("--check")
    assert code == 1 and "no stored episodes" in said and "page.md" in said

    # three seeds, of which the experiment names two; then a suite on which one policy runs
    policies = ["straight", "random"]
    out = tmp_path / "run"
    results = bench("maze-2d-3", policies, episodes=3, seed=6, workers=0, out=out)
    code, said = call("--take", str(out), "small")
    assert code == 0 and "4 episodes taken, 4 stored" in said
    out = tmp_path / "other"
    bench("maze-2d-5", policies, episodes=2, seed=7, workers=0, out=out)
    code, said = call("--take", str(out), "small")
    assert code == 0 and "2 episodes taken, 6 stored" in said

    text = page.read_text()
    assert text.startswith("Before.\n") and text.endswith("After.\n")
    assert "seeds 7 to 8" in text and "pushplan experiment benchmarks/experiments/small" in text
    of_straight = [row for row in results.rows if row.policy == "straight" and row.seed >= 7]
    mean = sum(row.E_nav or 0.0 for row in of_straight) / 2
    assert f"| `maze-2d-3` | `straight` | 2 | 1.00 [0.34, 1.00] | {mean:.3f} [" in text
    assert "| `maze-2d-5` | `random` | 2 | 0.00 [0.00, 0.66] | 0 |" in text
    assert "| `maze-2d-3` | `random` | +1.000 [+1.000, +1.000] |" in text
    assert text.count("maze-2d-5") == 1  # the second table leaves it out

    assert call("--check") == (0, "")
    page.write_text(text.replace("[0.34, 1.00]", "[0.94, 1.00]"))
    code, said = call("--check")
    assert code == 1 and "docs/page.md" in said and "[0.94, 1.00]" in said.splitlines()[0]
    assert call()[0] == 0 and page.read_text() == text

    lines = stored.read_text().splitlines(keepends=True)
    stored.write_text("".join([*lines[:1], *lines[2:]]))  # without the first episode
    code, said = call("--check")
    assert code == 1 and "| `maze-2d-3` | `straight` | 1 |" in said
    stored.write_text("".join([*lines, lines[-1]]))
    code, said = call("--check")
    assert code == 1 and "may have an episode once" in said


@pytest.mark.slow
def test_scenarios_of_a_suite_that_share_a_seed_are_kept_apart(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stored = tmp_path / "benchmarks" / "experiments" / "doors.csv"
    stored.parent.mkdir(parents=True)
    text = EXPERIMENT.replace("[maze-2d-3, {suite: maze-2d-5, policies: [random]}]", "[FIXED]")
    text = text.replace("episodes: 2", "episodes: 3").replace("FIXED", "namo-2d-fixed")
    stored.with_suffix(".yaml").write_text(text)
    bench("namo-2d-fixed", ["random"], episodes=3, seed=7, workers=0, out=tmp_path / "run")
    assert main(["--root", str(tmp_path), "--take", str(tmp_path / "run"), "doors"]) == 0
    assert "3 episodes taken, 3 stored" in capsys.readouterr().out
    names = [f"namo-2d-fixed[movability={name}]" for name in ("known", "unknown", "wrong")]
    assert [line.split(",")[0] for line in stored.read_text().splitlines()[1:]] == names


@pytest.mark.parametrize(
    ("marker", "said"),
    [
        ("<!-- table: mppi; columns: succes -->\nEND", "unknown column 'succes'"),
        ("<!-- table: mppi; colums: success -->\nEND", "colums"),
        ("<!-- table: mppi; suites: maze-4* -->\nEND", "unknown suite"),
        ("<!-- table: mppi; policies: straight me -->\nEND", "unknown policy"),
        ("<!-- table: mppi; differences: me -->\nEND", "unknown policy"),
        ("<!-- table: mppi -->\n", "needs a '<!-- end of the table -->'"),
    ],
)
def test_a_wrong_comment_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], marker: str, said: str
) -> None:
    (tmp_path / "docs").mkdir()
    (tmp_path / "benchmarks").symlink_to(ROOT / "benchmarks")
    page = tmp_path / "docs" / "page.md"
    page.write_text(marker.replace("END", "<!-- end of the table -->"))
    assert main(["--root", str(tmp_path)]) == 1
    printed = capsys.readouterr().out
    assert "page.md" in printed and said in printed and len(printed.splitlines()) == 1
