"""Numbers in tables say over which runs they are, and tables hold what is asked for now."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from evaluation_doubles import HERE, LineScenario

from pushplan.cli import main
from pushplan.evaluation import (
    Experiment,
    Job,
    JobSettings,
    ResultRow,
    Results,
    bootstrap_interval,
    compare_runs,
    merge,
    parse_policies,
    run_batch,
)
from pushplan.evaluation.report.table_formats import latex, markdown, summary_csv, text
from pushplan.evaluation.report.tables import RUNS_NOTE, difference_tables
from pushplan.evaluation.statistics.aggregates import interquartile_mean, performance_profile
from pushplan.evaluation.statistics.estimates import estimate
from pushplan.evaluation.store.rows import rows_csv
from pushplan.evaluation.stress_testing import CONDITIONS, ScoreSheet, _judged

SETTINGS = JobSettings(make_env=f"{HERE}:make_env", timeout_s=5.0, dry_run=False)
VALUES = {"I_nav": 0.9, "path_length_m": 20.0, "interaction_work_kg_m": 1.0, "steps": 100}


def row(policy: str, seed: int, *, failed: bool = False, setting: str = "maze-5") -> ResultRow:
    """A run whose I_nav is worse the higher its seed is."""
    metrics = {"E_nav": 0.9, **VALUES, "I_nav": 1.0 - 0.02 * seed}
    return ResultRow(
        policy=policy,
        task="maze",
        simulator="pymunk",
        scenario=f"{setting}-{seed}",
        seed=seed,
        status="policy_error" if failed else "done",
        reason="boom" if failed else "goal",
        success=not failed,
        metrics={"E_nav": 0.0, "steps": 3} if failed else metrics,
        wall_time_s=0.01 if failed else 1.0 + 0.01 * seed,
        decision_time_median_s=0.001,
        decision_time_max_s=0.002,
        job=f"{policy}-{setting}-{seed}",
    )


def crashing(settings: tuple[str, ...] = ("maze-5",)) -> tuple[ResultRow, ...]:
    """Runs of two policies of which the second differs only by 4 crashes of 16 in each setting."""
    sure = [row("sure", seed, setting=one) for one in settings for seed in range(16)]
    fails = [replace(one, policy="crash", job=f"crash-{one.job}") for one in sure]
    return (
        *sure,
        *(
            row("crash", one.seed, failed=True, setting=one.setting) if one.seed > 11 else one
            for one in fails
        ),
    )


def jobs(names: str, seeds: range) -> list[Job]:
    specs = parse_policies([f"{HERE}:{name}" for name in names.split()])
    return [Job(spec, LineScenario(seed)) for seed in seeds for spec in specs]


def batch(out: Path, names: str, seeds: range, **options: object) -> Results:
    run_batch(jobs(names, seeds), out=out, workers=0, settings=SETTINGS, **options)  # type: ignore[arg-type]
    return Results.load(out)


def runs(results: Results) -> dict[str, int]:
    return {one.policy: one.episodes for one in results.pooled.summary()}


# what is asked for now


def test_a_study_made_smaller_has_the_same_starts_for_all_policies(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    command = ["bench", "maze-2d-3,maze-2d-5", "--workers", "0", "--out", str(out), "--policies"]
    assert main([*command, "straight", "--episodes", "3"]) == 0
    capsys.readouterr()
    assert main([*command, "random,straight", "--episodes", "2"]) == 0
    said = capsys.readouterr().out
    assert f"{out} also holds results that the last command did not ask for: 2 of straight" in said
    assert {one.episodes for one in Results.load(out).summary()} == {2}
    assert runs(Results.load(out)) == {"random": 4, "straight": 4}
    assert len((out / "results.csv").read_text().splitlines()) == 1 + 8
    # the order of this command, not that of the first one
    assert {pair.first for pair in Results.load(out).compare()} == {"random"}
    for words in ([], ["--format", "latex"], ["--metrics", "E_nav"], ["--json"]):
        assert main(["report", str(out), *words]) == 0
        assert "did not ask for: 2 of straight" in "".join(capsys.readouterr())
    for name in ("summary.md", "report.html"):
        assert "did not ask for: 2 of straight" in (out / name).read_text()
    # nothing was removed, and nothing runs again
    assert main([*command, "straight", "--episodes", "3"]) == 0
    assert "6 jobs, all done" in capsys.readouterr().err
    assert runs(Results.load(out)) == {"straight": 6}


def test_two_experiments_in_one_folder_do_not_mix(tmp_path: Path) -> None:
    first = batch(tmp_path, "Ahead Raises", range(4))
    second = batch(tmp_path, "Logs", range(2, 6))
    assert runs(second) == {"Logs": 4}
    assert second.about["left_out"] == {"Ahead": 4, "Raises": 4}
    assert len(list((tmp_path / "episodes").iterdir())) >= 4
    again = batch(tmp_path, "Ahead Raises", range(4))
    assert again.rows == first.rows and again.about["left_out"] == {"Logs": 4}


def test_failures_of_another_study_are_kept(tmp_path: Path) -> None:
    batch(tmp_path, "Raises", range(4))
    batch(tmp_path, "Raises", range(1), retry_failed=True)
    assert batch(tmp_path, "Raises", range(4)).about["runs"][-1]["jobs"] == 1


def test_a_merged_folder_shows_all_that_its_parts_show(tmp_path: Path) -> None:
    batch(tmp_path / "one", "Ahead", range(4))
    batch(tmp_path / "two", "Ahead", range(4))
    batch(tmp_path / "two", "Ahead", range(1))
    batch(tmp_path / "three", "Logs", range(3))
    merge(tmp_path / "two", [tmp_path / "one", tmp_path / "three"])
    found = Results.load(tmp_path / "two")
    assert runs(found) == {"Ahead": 4, "Logs": 3} and not found.remarks


def test_what_a_cut_study_lacks_is_said(tmp_path: Path) -> None:
    def stop(done: int, total: int, one: ResultRow | None) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        batch(tmp_path, "Ahead Logs", range(4), progress=stop)
    cut = Results.load(tmp_path)
    assert "5 of 8 jobs have no result yet" in cut.table()
    (table, *_) = cut.tables()
    assert [line[1] for line in table.cells] == ["2", "1 of 2"] and RUNS_NOTE in table.note


def test_a_study_cut_before_its_first_result_hides_the_others_but_names_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def stop(done: int, total: int, one: ResultRow | None) -> None:
        raise KeyboardInterrupt

    batch(tmp_path, "Ahead", range(2))
    with pytest.raises(KeyboardInterrupt):
        batch(tmp_path, "Logs", range(4), progress=stop)
    assert main(["report", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "4 of 4 jobs have no result yet" in said and "2 of Ahead" in said
    assert runs(batch(tmp_path, "Ahead", range(2))) == {"Ahead": 2}


def test_the_cost_counts_stored_results_as_the_run_does(tmp_path: Path) -> None:
    data = {"schema": "pushplan-experiment/1", "suites": ["maze-2d-3"], "policies": ["straight"]}
    first = Experiment.from_dict({**data, "episodes": 3, "timeout_s": 60})
    first.run(tmp_path, workers=0)
    Experiment.from_dict({**data, "episodes": 1, "timeout_s": 50}).run(tmp_path, workers=0)
    assert first.cost(tmp_path).new == 0  # they are stored, though they do not count now
    other = Experiment.from_dict({**data, "episodes": 1, "timeout_s": 40})
    assert other.cost(tmp_path, any_version=True).new == 1  # it differs in more than versions


# failed runs


def test_no_crash_improves_a_mean_unmarked() -> None:
    """Every cell in which the crashing policy looks better says of how many runs it is."""
    settings = ("maze-5", "maze-10")
    results = Results(crashing(settings))
    tables = results.tables(wide=True, settings=True)
    means = 0
    for table in tables:
        sure, crash = ([line for line in table.cells if line[0] == p] for p in ("sure", "crash"))
        for name, one, two in zip(table.headings, *sure, *crash, strict=True) if crash else ():
            if name in ("I_nav", "path [m]", "work [kg m]", "wall [s]"):
                means += 1
                runs = 24 if "2 settings" in table.title else 12
                assert f"n = {runs}" in two and "n = " not in one, (table.title, name)
        if crash:
            assert RUNS_NOTE in table.note
            for shown in (markdown([table]), text([table]), latex([table])):
                assert "n = 12" in shown or "n = 24" in shown
    assert means == 3 * 4 + 1
    assert RUNS_NOTE not in Results(tuple(r for r in results.rows if r.policy == "sure")).table()


def test_a_policy_of_which_every_run_fails_has_the_note_too() -> None:
    (table, *_) = Results(tuple(row("crash", seed, failed=True) for seed in range(3))).tables()
    assert table.cells[0][1] == "3\n3 failed" and RUNS_NOTE in table.note


def test_sums_up_to_a_failure_are_in_no_mean() -> None:
    found, _ = Results(crashing()).summary()
    assert (found.policy, found.failed) == ("crash", 4)
    counts = {name: one.count for name, one in found.metrics.items()}
    assert {name for name, count in counts.items() if count == 16} == {
        *("E_nav", "decision_time_median_s", "decision_time_max_s")
    }
    assert counts["steps"] == counts["wall_time_s"] == 12
    lines = [*csv.DictReader(summary_csv([found], {}).splitlines())]
    assert {one["metric"]: int(one["count"]) for one in lines} == {"success": 16, **counts}


def test_metrics_of_stored_episodes_take_failures_as_the_tables_do(tmp_path: Path) -> None:
    rows = crashing()
    measured = {r.job: {"E_nav": 0.9, "I_nav": 0.9, "own": 1.0} for r in rows if not r.failed}
    names = ["E_nav", "I_nav", "own"]
    results = Results(rows, about={"metrics": names}, measured=measured)
    (table,) = (one for one in results.tables() if "own" in one.headings)
    assert table.cells[0][1].startswith("0.675 ±") and "n = " not in table.cells[0][1]
    assert all(cell.endswith("n = 12") for cell in table.cells[0][2:])
    assert all("n = " not in cell for cell in table.cells[1])


def test_a_brief_table_of_differences_says_where_it_is_of_fewer() -> None:
    sweep = [
        replace(one, policy=f"{one.policy}-{k}", job=f"{one.job}-{k}")
        for k in range(4)
        for one in crashing()
    ]
    results = Results(tuple(sweep))
    (table,) = difference_tables(results.compare("all"), results.titles)
    assert table.headings == ("pair", "success", "E_nav", "I_nav") and "same 16 sc" in table.note
    for names, *cells in table.cells:
        assert ["\nn = 12" in cell for cell in cells] == [False, False, "crash" in names]


def test_a_gate_says_how_many_scenarios_it_has_seen(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = crashing()
    (tmp_path / "old.csv").write_text(rows_csv([one for one in rows if one.policy == "sure"]))
    new = [replace(one, policy="sure") for one in rows if one.policy == "crash"]
    (tmp_path / "new.csv").write_text(rows_csv(new))
    old = tmp_path / "old.csv"
    found = compare_runs(old, tmp_path / "new.csv", "I_nav<-0.01,wall_time>+5%,success<-0.0")
    assert [(one.count, one.known) for one in found] == [(12, 16), (12, 16), (16, 16)]
    main(["runs", "compare", str(old), str(tmp_path / "new.csv")])
    assert capsys.readouterr().out.count("12 of 16") == 1


def test_a_stress_test_says_over_how_many_episodes_a_mean_is() -> None:
    condition = CONDITIONS["together"]
    rows = [one for one in crashing() if one.policy == "crash"]
    calm = {one.seed: one for one in crashing() if one.policy == "sure"}
    found = _judged("together", condition, rows, calm)
    assert found.counts == {"E_nav": 16, "I_nav": 12}
    table = ScoreSheet("crash", "maze", (found,)).table()
    cells = dict(zip(table.headings, *table.cells, strict=True))
    assert cells["I_nav"].endswith("n = 12") and "n = " not in cells["E_nav"]
    assert "failed ones have E = 0, but no I" in table.note


def test_figures_draw_the_means_of_the_tables_and_name_failures() -> None:
    results = Results(crashing())
    crash, _ = results.summary()
    axes, *_ = results.figure("tradeoff").axes
    handles, labels = axes.get_legend_handles_labels()
    (place,) = (
        one.lines[0].get_xydata()[0]
        for one, label in zip(handles, labels, strict=True)
        if label == "crash (4 failed)"
    )
    assert place.tolist() == [crash.metrics["I_nav"].mean, crash.metrics["E_nav"].mean]
    for name in ("profiles", "intervals"):
        figure = results.figure(name)
        ticks = [tick.get_text() for tick in figure.axes[0].get_yticklabels()]
        named = [*ticks, *figure.axes[0].get_legend_handles_labels()[1]]
        assert "crash (4 failed)" in [one.replace("\n", " ") for one in named]
    assert "sure" in labels


# intervals


def test_one_value_has_no_interval() -> None:
    assert np.isnan(bootstrap_interval([0.3])).all()
    one = estimate([0.3])
    assert (one.count, one.mean, one.median) == (1, 0.3, 0.3)
    assert np.isnan([one.sd, one.low, one.high]).all()
    few = [np.array([0.3]), np.array([0.5])]
    assert math.isnan(interquartile_mean(few).low) and math.isnan(interquartile_mean(few).high)
    assert np.isnan(performance_profile(few, np.linspace(0, 1, 5)).low).all()
    assert interquartile_mean([*few, np.array([0.1, 0.9])]).low < 0.5


def test_one_run_shows_no_interval_and_no_spread(tmp_path: Path) -> None:
    a = [row("a", 1, setting=name) for name in ("maze-5", "maze-10")]
    b = [replace(one, policy="b", job=f"b{one.job}", metrics={"E_nav": 0.5}) for one in a]
    results = Results((*a, *b))
    tables = [
        one for one in results.tables(wide=True, settings=True) if "together" not in one.title
    ]
    for table in tables:
        for line in table.cells:
            for name, cell in zip(table.headings, line, strict=True):
                if name not in ("success", "metric"):  # Wilson's interval has a width
                    assert "[" not in cell and "±" not in cell, (table.title, name, cell)
    assert len(tables) == 1 + 2 * 2
    page = results.report(tmp_path / "page")
    with (page.parent / "summary.csv").open() as file:
        lines = [line for line in csv.DictReader(file) if line["metric"] != "success"]
    assert {line["low"] + line["high"] + line["sd"] for line in lines} == {""}
    assert "nan" not in (page.parent / "differences.csv").read_text().lower()


def test_one_scenario_that_changed_decides_no_gate(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old, worse = tmp_path / "old.csv", tmp_path / "worse.csv"
    old.write_text(rows_csv([row("a", 0)]))
    worse.write_text(rows_csv([replace(row("a", 0), metrics={"E_nav": 0.895})]))
    (found,) = compare_runs(old, worse, "E_nav<-0.01")
    assert found.verdict == "unclear"
    assert main(["runs", "compare", str(old), str(worse), "--fail-on", "E_nav<-0.01"]) == 0
    assert "[" not in capsys.readouterr().out
    (found,) = compare_runs(old, old, "E_nav<-0.01")
    assert found.verdict == "ok"


def test_repeats_of_one_drive_are_one_run() -> None:
    """A world file without spread: only the seed differs between the runs."""
    alike = [
        replace(row("mine", seed), task="room", metrics={"E_nav": 0.9, **VALUES})
        for seed in range(6)
    ]
    (found,) = Results(tuple(alike)).summary()
    assert found.episodes == 6 and found.success.count == found.metrics["E_nav"].count == 1
    assert math.isnan(found.metrics["E_nav"].low)
    assert found.metrics["wall_time_s"].count == 6  # measured six times
    (table, *_) = Results(tuple(alike)).tables()
    assert table.cells[0][2].endswith("n = 1") and table.cells[0][3] == "0.900\nn = 1"
    other = replace(alike[-1], metrics={**VALUES, "E_nav": 0.7})
    (found,) = Results((*alike[:-1], other)).summary()
    assert found.metrics["E_nav"].count == 6 and found.metrics["E_nav"].low < 0.9


# starts


def test_policies_on_other_starts_are_pointed_out() -> None:
    rows = [*(row("a", seed) for seed in range(6)), *(row("b", seed) for seed in range(4, 10))]
    (table, *_) = Results(tuple(rows)).tables()
    assert [line[1] for line in table.cells] == ["6 of 10", "6 of 10"] and RUNS_NOTE in table.note
    assert [one.missing for one in Results(tuple(rows)).summary()] == [4, 4]
