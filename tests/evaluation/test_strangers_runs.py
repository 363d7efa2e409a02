"""Run directories that strangers prepared: one line, bounded work, nothing outside is touched."""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
import struct
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from evaluation_doubles import stored_run

from pushplan.cli import main
from pushplan.cli.parser import build_parser
from pushplan.evaluation import Results
from pushplan.evaluation.report.comparing import read_rules
from pushplan.world import InvalidInputError


@pytest.fixture(scope="module", autouse=True)
def one_parser() -> Iterator[None]:
    """Build the parser once: that takes longer than most of the four hundred commands here."""
    parser = build_parser()
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("pushplan.cli.parser.build_parser", lambda: parser)
        yield


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy two folders deep, so that ``../..`` leads to the folder of the test."""
    monkeypatch.chdir(tmp_path)
    return stored_run(tmp_path / "theirs" / "run")


COMMANDS = (
    ["runs", "status", "theirs/run"],
    ["report", "theirs/run", "--replays", "beside"],
    ["runs", "merge", "out/merged", "theirs/run"],
    ["runs", "salvage", "theirs/run", "out/saved"],
    ["runs", "rescore", "theirs/run"],
    ["runs", "export", "theirs/run", "out/rows.csv"],
    ["runs", "compare", "theirs/run", "theirs/run", "--fail-on", "steps<0"],
    ["runs", "reproduce", "theirs/run", "--job", "0"],
    ["runs", "verify", "theirs/run", "--workers", "1"],
)


def outside(folder: Path) -> set[str]:
    """What is in the folder of a test beside the run directory and what commands make."""
    (folder / "out").mkdir(exist_ok=True)
    found = {path.relative_to(folder) for path in folder.rglob("*")}
    ours = ("theirs", "out")
    return {str(path) for path in found if path.parts[0] not in ours or len(path.parts) < 3}


def attempt(run: Path, capsys: pytest.CaptureFixture[str]) -> dict[str, int]:
    """Exit code of each command; each says one line at most on standard error."""
    folder = run.parents[1]
    before, codes = outside(folder), {}
    for words in COMMANDS:
        capsys.readouterr()
        command = words[words[0] == "runs"]
        codes[command] = main(words)
        err = capsys.readouterr().err
        assert err.count("\n") <= 1 and "Traceback" not in err, (words, err)
        if codes[command] == 2:
            assert len(err.splitlines()[0]) < 400
    made = {"out/merged", "out/saved", "out/rows.csv"}
    assert outside(folder) - made == before
    return codes


def sql(run: Path, *statements: str) -> None:
    with sqlite3.connect(run / "results.db") as db:
        for statement in statements:
            db.execute(statement)
    db.close()


@pytest.mark.parametrize(
    "name",
    ["../../evil", "/tmp/evil", "a\nb", "a\x00b", "x" * 300],
    ids=repr,
)
@pytest.mark.parametrize("column", ["job", "trace"])
def test_a_name_leads_nowhere(
    name: str, column: str, run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with sqlite3.connect(run / "results.db") as db:
        where = (
            "status = 'done' AND seed = 1" if column == "trace" else "seed = 1 AND status != 'done'"
        )
        db.execute(f"UPDATE results SET {column} = ? WHERE {where}", (name,))
    codes = attempt(run, capsys)
    assert {command for command, code in codes.items() if code != 2} <= {"status", "salvage"}


@pytest.mark.parametrize("column", ["policy", "scenario", "task"])
def test_no_text_moves_the_cursor_of_a_terminal(
    column: str, run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sql(run, f"UPDATE results SET {column} = 'a' || char(27) || '[2J' WHERE seed = 1")
    assert main(["report", str(run)]) == 2
    assert "\x1b" not in capsys.readouterr().err
    main(["runs", "status", str(run)])
    assert "\x1b" not in capsys.readouterr().out


FOREVER = "WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n) SELECT x FROM n"
SCHEMAS = {
    "view": (
        "ALTER TABLE results RENAME TO hidden",
        f"CREATE VIEW results AS SELECT * FROM hidden, ({FOREVER})",
    ),
    "view of notes": ("DROP TABLE about", f"CREATE VIEW about AS {FOREVER}"),
    "trigger": ("CREATE TRIGGER t AFTER INSERT ON running BEGIN DELETE FROM results; END",),
    "another table": ("CREATE TABLE more (x TEXT)",),
    "virtual table": ("CREATE VIRTUAL TABLE more USING fts5(x)",),
    "virtual results": ("DROP TABLE results", "CREATE VIRTUAL TABLE results USING fts5(job)"),
    "generated column": ("ALTER TABLE results ADD COLUMN x TEXT AS (hex(zeroblob(900000000)))",),
    "default": ("ALTER TABLE results ADD COLUMN x TEXT DEFAULT 'more'",),
    "check": ("DROP TABLE running", "CREATE TABLE running (job TEXT, CHECK (job > 'a'))"),
    "index": ("CREATE INDEX i ON results (hex(zeroblob(1000)))",),
}


@pytest.mark.parametrize("statements", SCHEMAS.values(), ids=SCHEMAS)
def test_a_database_holds_plain_tables_of_ours_alone(
    statements: tuple[str, ...], run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sql(run, *statements)
    codes = attempt(run, capsys)
    assert {command for command, code in codes.items() if code != 2} <= {"salvage"}


def test_a_forged_tree_of_pages_is_left_after_bounded_work(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Pages that stand in many places give billions of rows of a file of 300 kB."""
    sql(run, "PRAGMA journal_mode=DELETE", "INSERT INTO running VALUES ('a', 'b', 1.0)")
    file = run / "results.db"
    data = bytearray(file.read_bytes())
    size = struct.unpack(">H", data[16:18])[0]
    with sqlite3.connect(file) as db:
        ((root,),) = db.execute("SELECT rootpage FROM sqlite_master WHERE name = 'running'")
    leaf = bytes(data[(root - 1) * size : root * size])
    last = len(data) // size
    data[(root - 1) * size : root * size] = _interior(last + 1, size)
    data += _interior(last + 2, size) + _interior(last + 3, size) + _interior(last + 4, size) + leaf
    data[28:32] = struct.pack(">I", len(data) // size)
    file.write_bytes(data)
    assert main(["runs", "status", str(run)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert main(["runs", "rescore", str(run)]) == 2


def _interior(child: int, size: int) -> bytes:
    """A page of a table's tree, all of whose children are one page."""
    count = 300
    page, cells = bytearray(size), bytearray()
    places = []
    for number in range(count):
        cells += struct.pack(">I", child) + bytes([0x80 | number >> 7, number & 0x7F])
        places.append(size - 6 * (number + 1))
    for number, place in enumerate(places):
        page[place : place + 6] = cells[6 * number : 6 * number + 6]
    start = size - 6 * count
    page[:12] = struct.pack(">BHHHBI", 5, 0, count, start, 0, child)
    page[12 : 12 + 2 * count] = struct.pack(f">{count}H", *places)
    return bytes(page)


NOTES = {
    "runs": [5, [5], [{}], {"a": 1}, "x", [{"packages": 1}], None],
    "policies": [5, [], {"a": 5}, None, "x"],
    "settings": [5, [], {"line": {}}, None],
    "deadlines": [5, {"a": "b"}, {"a": 1e400}, {"a": None}],
    "metrics": [5, {}, [5], [["a"]], None],
    "configuration": [5, [], None, "x"],
    "schema": [5, None, [], "pushplan-run/9"],
}


@pytest.mark.parametrize("key", NOTES)
def test_notes_of_a_wrong_type_are_one_line(
    key: str, run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for value in NOTES[key]:
        with sqlite3.connect(run / "results.db") as db:
            db.execute("INSERT OR REPLACE INTO about VALUES (?, ?)", (key, json.dumps(value)))
        assert main(["report", str(run)]) == 2, value
        assert capsys.readouterr().err.count("\n") == 1
        assert main(["runs", "merge", str(run.parent / "merged"), str(run)]) == 2, value
        assert main(["runs", "status", str(run)]) == 2, value
        capsys.readouterr()


TEXTS = {
    "deep": "[" * 100_000,
    "long number": "[" + "1" * 10_000 + "]",
    "twice": '{"a": 1, "a": 2}',
    "many": "[" + "1," * 2_000_000 + "1]",
    "none": "",
}


@pytest.mark.parametrize(
    "text", [*TEXTS.values(), 5, b"\xff", None], ids=[*TEXTS, "5", "blob", "NULL"]
)
@pytest.mark.parametrize(
    "where",
    [
        "UPDATE about SET value = ? WHERE key = 'runs'",
        "UPDATE results SET spec = ? WHERE seed = 1 AND success",
    ],
)
def test_json_that_is_none_is_one_line(
    text: object, where: str, run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with sqlite3.connect(run / "results.db") as db:
        db.execute(where, (text,))
    for words in COMMANDS[2:3] + COMMANDS[4:5]:  # these read all that is there
        assert main(words) == 2
        assert capsys.readouterr().err.count("\n") == 1


SPECS = [
    {},
    {"policy": 5, "settings": {}, "scenario": {}, "key": []},
    {
        "policy": {"label": "a", "identity": "b", "source": 5},
        "settings": 5,
        "scenario": 5,
        "key": 5,
    },
    {"policy": {"label": 5, "source": "straight", "options": 5}, "settings": {}, "scenario": {}},
]


@pytest.mark.parametrize("spec", SPECS, ids=str)
def test_a_job_that_is_none_is_not_reproduced(
    spec: object, run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with sqlite3.connect(run / "results.db") as db:
        db.execute("UPDATE results SET spec = ? WHERE seed = 1 AND success", (json.dumps(spec),))
        ((job,),) = db.execute("SELECT job FROM results LIMIT 1")
    assert main(["runs", "reproduce", str(run), "--job", job]) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize(
    "change",
    [
        "success = 'yes'",
        "seed = 1.5",
        "steps = 'many'",
        "wall_time_s = 9e999",
        "policy = NULL",
        "reason = zeroblob(100)",
        "plan_calls = 'x'",
    ],
)
def test_values_of_a_wrong_type_are_one_line(
    change: str, run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sql(run, f"UPDATE results SET {change} WHERE seed = 1")
    codes = attempt(run, capsys)
    assert codes["merge"] == codes["rescore"] == 2


def test_a_value_has_a_greatest_length(
    run: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("pushplan.evaluation.store.database.MAX_TEXT", 100_000)
    sql(run, "UPDATE results SET reason = hex(zeroblob(100000)) WHERE seed = 1")
    assert main(["report", str(run)]) == main(["runs", "rescore", str(run)]) == 2
    assert capsys.readouterr().err.count("\n") == 2


def test_a_median_without_a_maximum_is_shown(run: Path) -> None:
    sql(
        run,
        "UPDATE results SET plan_calls = 3, plan_time_median_s = 0.1, plan_time_max_s = NULL, "
        "decision_time_max_s = NULL, trace = '' WHERE status = 'done'",
    )
    assert main(["report", str(run)]) == 0


def test_measured_values_of_a_wrong_type_are_one_line(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sql(
        run,
        "INSERT INTO measured SELECT job, 'mine', 'x', 'much' FROM results",
        "INSERT INTO about VALUES ('metrics', '[\"mine\"]')",
    )
    assert main(["report", str(run)]) == main(["runs", "export", str(run), "rows.csv"]) == 2
    assert capsys.readouterr().err.count("\n") == 2


def _link(path: Path) -> None:
    path.symlink_to(path.parents[2] / "mine.db")


PLACES: dict[str, Callable[[Path], None]] = {
    "pipe": os.mkfifo,
    "folder": Path.mkdir,
    "link": _link,
    "endless": lambda path: path.symlink_to("/dev/zero"),
}


@pytest.mark.parametrize("make", PLACES.values(), ids=PLACES)
@pytest.mark.parametrize("name", ["results.db", "results.db-wal", "results.db-shm"])
def test_a_database_is_a_regular_file(
    make: Callable[[Path], None], name: str, run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = run.parents[1] / "mine.db"
    shutil.copy(run / "results.db", mine)
    before = mine.read_bytes()
    (run / name).unlink(missing_ok=True)
    make(run / name)
    codes = attempt(run, capsys)
    assert {command for command, code in codes.items() if code != 2} <= {"salvage"}
    assert mine.read_bytes() == before


def test_a_journal_cannot_make_sqlite_remove_a_file(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The journal of a transaction over several files names one that goes when it is undone."""
    victim = run.parents[1] / "mine.txt"
    victim.write_text("mine")
    name = str(victim).encode()
    head = bytes.fromhex("d9d505f920a163d7") + struct.pack(">IIIII", 0, 0, 10, 512, 4096)
    tail = struct.pack(">I", 0x40000000 // 4096 + 1) + name
    tail += struct.pack(">II", len(name), sum(name)) + head[:8]
    (run / "results.db-journal").write_bytes(head.ljust(512, b"\0") + tail)
    codes = attempt(run, capsys)
    assert codes["rescore"] == codes["report"] == 2
    assert victim.read_text() == "mine"


def test_files_behind_links_are_not_taken_along(run: Path, tmp_path: Path) -> None:
    secret = tmp_path / "secret.txt"
    secret.write_text("secret")
    notes = [*(run / "failures").iterdir()]
    for path in notes:
        path.unlink()
        path.symlink_to(secret)
    assert main(["runs", "merge", "merged", str(run)]) == 0
    assert notes and not any((tmp_path / "merged" / "failures").iterdir())


@pytest.mark.usefixtures("empty_figures")
def test_a_page_shows_texts_as_they_are(run: Path) -> None:
    text = "</script><script>alert(1)</script><img src=x>"
    with sqlite3.connect(run / "results.db") as db:
        db.execute("UPDATE results SET policy = policy || '<b>', reason = ?", (text,))
        for key in ("policies", "settings"):
            value = json.dumps({text: text, "line": text})
            db.execute("INSERT OR REPLACE INTO about VALUES (?, ?)", (key, value))
        db.execute(
            "INSERT OR REPLACE INTO about VALUES ('configuration', ?)",
            (json.dumps({text: text, "suite": text}),),
        )
    assert main(["report", str(run)]) == 0
    page = (run / "report.html").read_text()
    assert not any(tag in page for tag in ("<script>alert", "<img", "<b>"))


def test_a_label_that_is_bad_mathematics_is_drawn_as_it_is(run: Path) -> None:
    sql(run, r"UPDATE results SET policy = policy || '$\bad$'")
    assert main(["report", str(run)]) == 0
    labels = Results.load(run).figure("intervals").axes[0].get_yticklabels()
    assert any(r"\bad" in label.get_text() for label in labels)


@pytest.mark.parametrize("bound", ["1e999", "-1e999", "+1e9999%"])
def test_a_bound_of_a_rule_is_finite(bound: str) -> None:
    with pytest.raises(InvalidInputError, match="no finite number"):
        read_rules(f"E_nav<{bound}")
    assert read_rules("E_nav<1e300")
