"""Folders that commands write into: a user's own files are neither removed nor replaced."""

from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Callable
from pathlib import Path

import pytest
from conftest import leave_figures_empty
from evaluation_doubles import SETTINGS, line_jobs, stored_run

from pushplan.cli import main
from pushplan.evaluation import Results, merge, run_batch, salvage
from pushplan.files.output_files import write_atomic
from pushplan.world import InvalidInputError

pytestmark = pytest.mark.usefixtures("empty_figures")
REPORT = ("report.html", "results.csv", "summary.md", "summary.csv", "differences.csv")


def run(out: Path) -> Results:
    run_batch(line_jobs(3), out=out, workers=0, settings=SETTINGS)
    return Results.load(out)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = stored_run(tmp_path_factory.mktemp("whole") / "run")
    with pytest.MonkeyPatch.context() as patched:
        leave_figures_empty(patched)
        Results.load(folder).report()
    return folder


def content(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def own_files(folder: Path) -> None:
    """A user's files with the names of ours."""
    for name in ("episodes/first.npz", "failures/log.txt", "results.csv", "draft.tmp", *REPORT):
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("mine")


DOORS: dict[str, Callable[[Path, Path], object]] = {
    "run_batch": lambda run_directory, out: run(out),
    "merge": lambda run_directory, out: merge(out, [run_directory]),
    "salvage": lambda run_directory, out: salvage(run_directory, out),
    "report": lambda run_directory, out: Results.load(run_directory).report(out),
}


@pytest.mark.parametrize("door", DOORS.values(), ids=DOORS)
@pytest.mark.parametrize("kind", ["files", "one file", "database"])
def test_a_folder_of_a_users_own_files_is_left_as_it_is(
    door: Callable[[Path, Path], object], kind: str, whole: Path, tmp_path: Path
) -> None:
    if kind == "one file":
        (tmp_path / "notes.txt").write_text("mine")
    else:
        own_files(tmp_path)
    if kind == "database":
        with sqlite3.connect(tmp_path / "results.db") as db:
            db.execute("CREATE TABLE about (key TEXT, value TEXT, mine TEXT)")
    before = content(tmp_path)
    with pytest.raises(InvalidInputError, match=r"is not empty|damaged|holds a run already|got"):
        door(whole, tmp_path)
    assert content(tmp_path) == before


@pytest.mark.parametrize(
    "words",
    [
        ["bench", "smoke", "--policies", "straight", "--out"],
        ["stress", "straight", "smoke", "--out"],
        ["experiment", "study.yaml", "--out"],
        ["train", "ppo", "--task", "maze", "--out"],
        ["demo", "--out"],
    ],
    ids=" ".join,
)
def test_commands_refuse_such_a_folder_before_they_begin(
    words: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    own_files(tmp_path / "mine")
    text = "schema: pushplan-experiment/1\nsuites: [smoke]\npolicies: [straight]\n"
    (tmp_path / "study.yaml").write_text(text)
    before = content(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert main([*words, "mine"]) == 2
    assert "is not empty" in capsys.readouterr().err
    assert content(tmp_path) == before


def test_a_run_directory_goes_on_and_keeps_what_is_not_ours(whole: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    shutil.copytree(whole, folder)
    mine = ("episodes/mine.npz", "episodes/mine.tmp", "draft.tmp", "failures/notes.txt")
    for name in mine:
        (folder / name).write_text("mine")
    torn = (".pushplan-0123456789abcdef.tmp", f"episodes/{'0' * 32}.npz")
    for name in torn:
        (folder / name).write_text("of a call that was killed")
    run(folder).report()
    assert all((folder / name).read_text() == "mine" for name in mine)
    assert not any((folder / name).exists() for name in torn)


def test_a_folder_in_which_a_run_was_killed_at_once_is_taken(tmp_path: Path) -> None:
    (tmp_path / ".lock").touch()
    (tmp_path / ".pushplan-0123456789abcdef.tmp").write_text("torn")
    assert len(run(tmp_path).rows) == 6


def test_a_report_is_written_again_beside_the_first_one(whole: Path, tmp_path: Path) -> None:
    results = Results.load(whole)
    page = results.report(tmp_path / "out")
    assert results.report(tmp_path / "out") == page


def link_to_own(folder: Path, name: str, target: Path) -> None:
    """Put a link to a user's file, or folder, in the place of one of ours."""
    if (folder / name).is_dir():
        shutil.rmtree(folder / name)
        target.mkdir()
        (target / "notes.npz").write_text("mine")
    else:
        (folder / name).unlink(missing_ok=True)
        target.write_text("mine")
    (folder / name).symlink_to(target)
    with sqlite3.connect(folder / "results.db") as db:  # so that there is something to write
        db.execute("DELETE FROM results WHERE seed = 1")


def test_links_in_the_place_of_reports_are_not_followed(whole: Path, tmp_path: Path) -> None:
    folder, names = tmp_path / "run", [*REPORT, "stress.md"]
    shutil.copytree(whole, folder)
    for number, name in enumerate(names):
        link_to_own(folder, name, tmp_path / f"mine {number}")
    run(folder).report()
    for number, name in enumerate(names):
        write_atomic(folder / name, b"ours")
        assert (tmp_path / f"mine {number}").read_text() == "mine"


@pytest.mark.parametrize("name", [".lock", "episodes", "failures"])
def test_links_in_a_run_directory_are_refused(name: str, whole: Path, tmp_path: Path) -> None:
    folder, target = tmp_path / "run", tmp_path / "mine"
    shutil.copytree(whole, folder)
    link_to_own(folder, name, target)
    before = content(target) if target.is_dir() else target.read_bytes()
    with pytest.raises(InvalidInputError, match=r"cannot use|is a link"):
        run(folder)
    assert (content(target) if target.is_dir() else target.read_bytes()) == before


def test_replays_are_not_written_through_a_link(whole: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    shutil.copytree(whole, folder)
    (tmp_path / "mine").mkdir()
    (folder / "replays").symlink_to(tmp_path / "mine")
    with pytest.raises(InvalidInputError, match="is a link"):
        Results.load(folder).report(replays="beside")
    assert not content(tmp_path / "mine")


def test_a_file_is_replaced_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "results.csv"
    path.write_text("old")
    (tmp_path / "results.csv.tmp").write_text("mine")
    with pytest.raises(TypeError):
        write_atomic(path, "no bytes")  # type: ignore[arg-type]
    assert content(tmp_path) == {"results.csv": b"old", "results.csv.tmp": b"mine"}
    write_atomic(path, b"new")
    assert content(tmp_path) == {"results.csv": b"new", "results.csv.tmp": b"mine"}
    assert path.stat().st_mode & 0o777 == 0o666 & ~_umask()


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


@pytest.mark.parametrize(
    "words",
    [
        ["plan", "world.yaml", "--planner", "straight", "--out"],
        ["run", "--task", "maze", "--policy", "straight", "--out"],
        ["runs", "export", "run"],
    ],
    ids=" ".join,
)
def test_a_file_to_write_is_no_link(
    words: list[str],
    whole: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run").symlink_to(whole)
    (tmp_path / "mine").write_text("mine")
    (tmp_path / "out.csv").symlink_to(tmp_path / "mine")
    shutil.copy(Path(__file__).parents[2] / "examples" / "room.yaml", tmp_path / "world.yaml")
    assert main([*words, "out.csv"]) == 2
    assert "is a link" in capsys.readouterr().err
    assert (tmp_path / "mine").read_text() == "mine"


def test_an_error_names_the_file_that_was_to_be_written(tmp_path: Path) -> None:
    for place in (tmp_path / "folder", tmp_path / "none" / "file"):
        (tmp_path / "folder").mkdir(exist_ok=True)
        with pytest.raises(OSError) as caught:
            write_atomic(place, b"ours")
        assert caught.value.filename == str(place)
    assert os.listdir(tmp_path) == ["folder"]
