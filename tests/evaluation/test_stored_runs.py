"""What can be done with run directories: join, score again, reproduce, export, look at."""

from __future__ import annotations

import csv
import json
import sqlite3
from dataclasses import replace
from pathlib import Path

import pytest
from evaluation_doubles import HERE, LineScenario, timeless

from pushplan.cli import main
from pushplan.evaluation import (
    Experiment,
    Job,
    JobSettings,
    PolicySpec,
    Results,
    merge,
    parse_policies,
    reproduce,
    rescore,
    run_batch,
    run_status,
    verify,
)
from pushplan.scenarios import Scenario, Suite, suite
from pushplan.world import InvalidInputError, SchemaError

SETTINGS = JobSettings(make_env=f"{HERE}:make_env", timeout_s=5.0, dry_run=False)


def run(out: Path, seeds: range, names: str = "Ahead Raises", **changes: object) -> None:
    specs = parse_policies([f"{HERE}:{name}" for name in names.split()])
    jobs = [Job(spec, LineScenario(seed)) for seed in seeds for spec in specs]
    run_batch(jobs, out=out, workers=0, settings=replace(SETTINGS, **changes))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def study() -> Experiment:
    specs = (PolicySpec("straight", "straight"), PolicySpec("random", "random"))
    return Experiment("study", (suite("maze-2d-3", episodes=2),), specs, JobSettings())


@pytest.fixture(scope="module")
def stored(study: Experiment, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stored") / "run"
    study.run(folder, workers=0)
    return folder


class TestMerge:
    def test_parts_give_what_one_machine_gives(self, tmp_path: Path) -> None:
        specs = parse_policies([f"{HERE}:{name}" for name in ("Ahead", "Raises", "Logs")])
        jobs = [Job(spec, LineScenario(seed)) for seed in range(3) for spec in specs]
        run_batch(jobs, out=tmp_path / "whole", workers=0, settings=SETTINGS)
        for part in range(3):
            mine = jobs[3 * part : 3 * part + 3]
            run_batch(mine, out=tmp_path / str(part), workers=0, settings=SETTINGS)
        parts = [tmp_path / str(part) for part in range(3)]
        done = merge(tmp_path / "all", parts)
        assert (done.added, done.known, done.differing, done.incomplete) == (9, 0, (), ())
        assert timeless(tmp_path / "all") == timeless(tmp_path / "whole")
        for row in Results.load(tmp_path / "all").rows:
            note = tmp_path / "all" / "failures" / f"{row.job}.txt"
            assert note.is_file() == row.failed
            assert (Results.load(tmp_path / "all").episode(row) is not None) == bool(row.trace)
        assert len(Results.load(tmp_path / "all").about["runs"]) == 3
        again = merge(tmp_path / "all", parts)
        assert (again.added, again.known, again.differing) == (0, 9, ())

    def test_the_parts_of_an_experiment_are_all_of_it(self, study: Experiment) -> None:
        from pushplan.evaluation.experiment import part_of

        parts = [part_of(study.jobs, part, 3) for part in (1, 2, 3)]
        assert sorted(job.key for part in parts for job in part) == sorted(
            job.key for job in study.jobs
        )
        for wrong in ((0, 3), (4, 3), (1, 0)):
            with pytest.raises(InvalidInputError, match="part"):
                part_of(study.jobs, *wrong)

    def test_a_result_that_differs_is_named_and_stays(self, tmp_path: Path) -> None:
        for name in ("a", "b"):
            run(tmp_path / name, range(1), "Ahead")
        with sqlite3.connect(tmp_path / "b" / "results.db") as db:
            db.execute("UPDATE results SET E_nav = 0.5")
        done = merge(tmp_path / "a", [tmp_path / "b"])
        (row,) = Results.load(tmp_path / "a").rows
        assert done.differing == (row.job,) and row.E_nav != 0.5

    def test_a_damaged_episode_is_left_out(self, tmp_path: Path) -> None:
        run(tmp_path / "a", range(2), "Ahead")
        first, second = Results.load(tmp_path / "a").rows
        assert first.trace_file is not None
        (tmp_path / "a" / first.trace_file).write_bytes(b"torn")
        done = merge(tmp_path / "b", [tmp_path / "a"])
        assert done.incomplete == (first.job,)
        assert Results.load(tmp_path / "b").rows == (second,)
        assert main(["runs", "merge", str(tmp_path / "c"), str(tmp_path / "a")]) == 1

    def test_the_last_of_two_settings_counts(self, tmp_path: Path) -> None:
        run(tmp_path / "a", range(1), "Ahead")
        run(tmp_path / "b", range(1), "Ahead", timeout_s=9.0)
        (other,) = Results.load(tmp_path / "b").rows
        merge(tmp_path / "a", [tmp_path / "b"])
        assert Results.load(tmp_path / "a").rows == (other,)

    def test_what_is_no_run_directory_is_refused(self, tmp_path: Path) -> None:
        run(tmp_path / "a", range(1), "Ahead")
        with pytest.raises(InvalidInputError, match="into itself"):
            merge(tmp_path / "a", [tmp_path / "a"])
        with pytest.raises(InvalidInputError, match="holds no results"):
            merge(tmp_path / "new", [tmp_path / "none"])
        assert not (tmp_path / "new").exists()
        with sqlite3.connect(tmp_path / "a" / "results.db") as db:
            db.execute("UPDATE about SET value = '\"pushplan-run/1\"' WHERE key = 'schema'")
        with pytest.raises(SchemaError, match="pushplan-run/2"):
            merge(tmp_path / "new", [tmp_path / "a"])


class TestReproduce:
    def test_a_job_comes_out_the_same(self, stored: Path) -> None:
        row = Results.load(stored).rows[-1]
        assert row.policy == "straight" and row.E_nav
        again = reproduce(stored, row.job[:10])
        assert again.same and not again.changed
        assert again.again.E_nav == row.E_nav

    @pytest.mark.slow
    def test_what_differs_is_named(
        self, stored: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        merge(tmp_path, [stored])
        row = Results.load(tmp_path).rows[0]
        with sqlite3.connect(tmp_path / "results.db") as db:
            (text,) = db.execute("SELECT spec FROM results WHERE job = ?", (row.job,)).fetchone()
            spec = json.loads(text)
            spec["versions"]["numpy"] = "0.9"
            db.execute("UPDATE results SET E_nav = 0.25, spec = ?", (json.dumps(spec),))
        found = reproduce(tmp_path, row.job)
        assert found.differing == ("E_nav",) and "numpy '0.9' ->" in found.changed
        assert main(["runs", "reproduce", str(tmp_path), "--job", row.job]) == 1
        assert "not the same: E_nav" in capsys.readouterr().err

    def test_what_cannot_be_made_again_is_said(self, tmp_path: Path) -> None:
        run(tmp_path, range(2), "Ahead")
        for job in ("", "zz"):
            with pytest.raises(InvalidInputError, match="must be the beginning of one job"):
                reproduce(tmp_path, job)
        with pytest.raises(InvalidInputError, match="none of pushplan's own"):
            reproduce(tmp_path, Results.load(tmp_path).rows[0].job)


class TestVerify:
    def test_a_sample_comes_out_the_same(self, stored: Path) -> None:
        found = verify(stored, fraction=0.3, seed=1, workers=1)
        assert (len(found.checked), found.jobs, found.differing, found.left_out) == (2, 4, (), 0)
        assert {one.stored.policy for one in found.checked} == {"random", "straight"}
        other = verify(stored, workers=1)
        assert len(other.checked) == 1  # 5 % of four is one
        rows = Results.load(stored).rows
        assert all(one.stored in rows for one in (*found.checked, *other.checked))

    @pytest.mark.slow
    def test_what_differs_is_said_with_both_values(
        self, stored: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        merge(tmp_path, [stored])
        row = next(row for row in Results.load(tmp_path).rows if row.policy == "straight")
        with sqlite3.connect(tmp_path / "results.db") as db:
            db.execute("UPDATE results SET E_nav = 0.25 WHERE job = ?", (row.job,))
        command = ["runs", "verify", str(tmp_path), "--fraction", "1", "--workers", "1"]
        assert main(command) == 1
        said = capsys.readouterr()
        assert said.out.startswith("3 of 4 jobs that ran again came out the same to the byte")
        assert f"{row.scenario} is not the same: E_nav 0.25 -> {row.E_nav!r}\n" in said.err
        assert main([*command, "--json"]) == 1
        checked = json.loads(capsys.readouterr().out)["checked"]
        (bad,) = [one for one in checked if not one["same"]]
        assert bad["differing"] == ["E_nav"] and bad["again"]["E_nav"] == row.E_nav

    @pytest.mark.slow
    def test_a_run_without_episodes_is_compared_by_its_rows(self, tmp_path: Path) -> None:
        starts = (Scenario("maze", variations={"boxes": 1}),)
        straight = (PolicySpec("straight", "straight"),)
        Experiment("few", (Suite("few", 1, starts),), straight, traces="none").run(tmp_path)
        assert verify(tmp_path, workers=1).checked[0].same

    def test_what_cannot_be_made_again_is_left_out_and_said(
        self, stored: Path, tmp_path: Path
    ) -> None:
        run(tmp_path / "own", range(2), "Ahead")
        with pytest.raises(InvalidInputError, match="none of pushplan's own"):
            verify(tmp_path / "own", workers=1)
        merge(tmp_path / "own", [stored])
        found = verify(tmp_path / "own", fraction=0.01, workers=1)
        assert (found.jobs, found.left_out, len(found.checked)) == (6, 2, 1)
        assert "none of pushplan's own" in found.why
        with pytest.raises(InvalidInputError, match=r"fraction must lie in \(0, 1\], got 1.5"):
            verify(stored, fraction=1.5)


class TestRescore:
    def test_columns_come_from_the_episodes(self, stored: Path, tmp_path: Path) -> None:
        merge(tmp_path, [stored])
        before = Results.load(tmp_path).rows
        done = rescore(tmp_path)
        assert (done.episodes, done.changed, done.unreadable) == (4, (), ())
        with sqlite3.connect(tmp_path / "results.db") as db:
            db.execute("UPDATE results SET path_length_m = 1.0 WHERE job = ?", (before[2].job,))
        assert rescore(tmp_path).changed == (before[2].job,)
        assert Results.load(tmp_path).rows == before

    def test_ones_own_metric_is_kept_until_its_file_changes(
        self, stored: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        merge(tmp_path / "run", [stored])
        file = tmp_path / "mine.py"
        file.write_text("def steps(episode):\n    return len(episode.actions)\n")
        metric = f"{file}:steps"
        assert rescore(tmp_path / "run", [metric], columns=False).episodes == 4
        assert rescore(tmp_path / "run", [metric], columns=False).episodes == 0
        results = Results.load(tmp_path / "run")
        row = results.rows[0]
        assert results.measured[row.job]["mine.py:steps"] == row.steps
        assert "mine.py:steps" in results.table()
        file.write_text("def steps(episode):\n    return 2 * len(episode.actions)\n")
        assert main(["runs", "rescore", str(tmp_path / "run"), "--metrics", metric]) == 0
        assert "4 episodes scored, 0 rows changed" in capsys.readouterr().out
        again = Results.load(tmp_path / "run").measured[row.job]["mine.py:steps"]
        assert row.steps is not None and again == 2 * row.steps

    @pytest.mark.parametrize("inside", [True, False], ids=["in the call", "at import"])
    def test_ones_own_metric_is_kept_until_what_it_reads_changes(
        self, stored: Path, tmp_path: Path, inside: bool
    ) -> None:
        merge(tmp_path / "run", [stored])
        read = f"open({str(tmp_path / 'data')!r}).read()"
        value = read if inside else "SCALE"
        file = tmp_path / "mine.py"
        file.write_text(f"SCALE = {read}\ndef scaled(episode):\n    return float({value})\n")
        for scale in ("2", "3.5"):
            (tmp_path / "data").write_text(scale)
            for count in (4, 0):
                done = rescore(tmp_path / "run", [f"{file}:scaled"], columns=False)
                assert done.episodes == count
            measured = Results.load(tmp_path / "run").measured.values()
            assert [one["mine.py:scaled"] for one in measured] == [float(scale)] * 4

    def test_a_metric_that_raises_is_one_line(self, stored: Path, tmp_path: Path) -> None:
        merge(tmp_path / "run", [stored])
        file = tmp_path / "bad.py"
        file.write_text("def bad(episode):\n    raise KeyError('wheels')\n")
        with pytest.raises(InvalidInputError, match=r"bad.py:bad' raised KeyError"):
            rescore(tmp_path / "run", [f"{file}:bad"])


class TestExport:
    def test_csv_and_parquet_hold_all_rows(self, stored: Path, tmp_path: Path) -> None:
        from pyarrow import parquet

        merge(tmp_path / "run", [stored])
        rescore(tmp_path / "run", ["E_nav_to_goal_point"])
        results = Results.load(tmp_path / "run")
        for name in ("rows.csv", "rows.parquet"):
            assert main(["runs", "export", str(tmp_path / "run"), str(tmp_path / name)]) == 0
        table = parquet.read_table(tmp_path / "rows.parquet").to_pylist()
        lines = list(csv.DictReader((tmp_path / "rows.csv").open()))
        for row, cells, line in zip(results.rows, table, lines, strict=True):
            assert cells["job"] == line["job"] == row.job
            assert cells["E_nav"] == float(line["E_nav"]) == row.E_nav
            value = results.measured[row.job]["E_nav_to_goal_point"]
            assert cells["E_nav_to_goal_point"] == float(line["E_nav_to_goal_point"]) == value

    def test_other_files_are_refused(self, stored: Path, tmp_path: Path) -> None:
        for name, said in (("rows.xlsx", "csv or .parquet"), ("no/rows.csv", "there is no folder")):
            with pytest.raises(InvalidInputError, match=said):
                Results.load(stored).export(tmp_path / name)


def test_status_says_how_far_a_run_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    seen = []
    specs = parse_policies([f"{HERE}:{name}" for name in ("Ahead", "Raises")])
    jobs = [Job(spec, LineScenario(seed)) for seed in range(2) for spec in specs]

    def look(done: int, total: int, row: object) -> None:
        seen.append(run_status(tmp_path))

    run_batch(jobs, out=tmp_path, workers=0, settings=SETTINGS, progress=look)
    assert [one.done for one in seen] == [0, 1, 2, 3, 4]
    assert all(one.active and one.jobs == 4 for one in seen)
    assert seen[2].left_s is not None and seen[2].left_s > 0.0 and seen[2].per_minute > 0.0
    rest = run_status(tmp_path)
    assert (rest.active, rest.done, rest.failed, rest.running) == (False, 4, 2, ())
    assert main(["runs", "status", str(tmp_path)]) == 0
    assert "at rest: 4 of 4 jobs done" in capsys.readouterr().out
    assert main(["runs", "status", str(tmp_path / "none")]) == 2


def test_an_episode_too_large_to_be_read_is_scored_and_not_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("pushplan.world.stored.episode.MAX_BYTES", 10)
    run(tmp_path / "run", range(1), "Ahead")
    (row,) = Results.load(tmp_path / "run").rows
    assert row.success and row.trace_file is None
    assert not list((tmp_path / "run" / "episodes").iterdir())
    assert "is not kept: an episode of" in caplog.text
