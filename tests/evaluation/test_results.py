from __future__ import annotations

import csv
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import leave_figures_empty

from pushplan.cli import main
from pushplan.evaluation import ResultRow, Results, bench
from pushplan.evaluation.statistics.summary import paired_differences
from pushplan.evaluation.store.run_directory import RunDirectory
from pushplan.world import InvalidInputError


def rows_of(policy: str, shift: float, seeds: int = 20, setting: str = "maze-5") -> list[ResultRow]:
    """Scores that differ between policies by ``shift`` in every scenario."""
    rng = np.random.default_rng(0)
    return [
        ResultRow(
            policy=policy,
            task="maze",
            simulator="pymunk",
            scenario=f"{setting}-{seed}",
            seed=seed,
            status="done",
            reason="goal",
            success=True,
            metrics={
                "E_nav": float(rng.uniform(0.5, 0.7) + shift),
                "I_nav": float(rng.uniform(0.8, 0.9)),
                "path_length_m": 20.0,
                "interaction_work_kg_m": 1.0,
                "steps": 100,
                "sim_time_s": 80.0,
            },
            wall_time_s=0.5,
            plan_calls=2,
            plan_time_median_s=0.01,
            plan_time_p99_s=0.02,
            plan_time_max_s=0.02,
            job=f"{policy}-{setting}-{seed}",
        )
        for seed in range(seeds)
    ]


def test_layouts_in_which_policies_drive_alike_by_chance_all_count() -> None:
    """No box was in the way, so that all drives are the same."""
    rows = [*rows_of("plain", 0.0), *rows_of("better", 0.1)]
    same = [replace(row, metrics=rows[0].metrics) for row in rows]
    assert {pair.difference.count for pair in paired_differences(same)} == {20}


@pytest.fixture
def results(tmp_path: Path) -> Results:
    with RunDirectory(tmp_path / "run") as store:
        store.note("configuration", {"suite": "maze-2d-5"})
        store.note("policies", {"plain": "plain", "better": "mine.py:Better"})
        store.extend("settings", {"maze-5": "maze, 5 boxes", "maze-10": "maze, 10 boxes"})
        for setting in ("maze-10", "maze-5"):
            for row in [
                *rows_of("plain", 0.0, setting=setting),
                *rows_of("better", 0.1, 19, setting),
            ]:
                store.add(row)
        last = rows_of("better", 0.0)[-1]
        bad = replace(
            last,
            status="crashed",
            reason="ended by <SIGKILL>",
            success=False,
            metrics={**{n: v for n, v in last.metrics.items() if n != "I_nav"}, "E_nav": 0.0},
        )
        store.add(bad, detail="what happened")
        store.write_csv()
    return Results.load(tmp_path / "run")


def test_policies_keep_their_order_and_settings_are_sorted_by_number(results: Results) -> None:
    assert results.policies == ["plain", "better"]
    assert list(results.titles.values()) == ["maze, 5 boxes", "maze, 10 boxes"]


def test_a_failed_job_counts_against_its_policy(results: Results) -> None:
    better = next(s for s in results.summary() if s.policy == "better")
    assert (better.episodes, better.failed) == (20, 1)
    assert better.success.fraction == 0.95
    assert better.metrics["E_nav"].count == 20
    assert better.metrics["I_nav"].count == 19


def test_differences_are_taken_scenario_by_scenario(results: Results) -> None:
    pair = next(p for p in results.compare() if p.setting == "maze-10" and p.metric == "E_nav")
    assert (pair.first, pair.second) == ("plain", "better")
    # the spread between scenarios is far greater than the difference, and cancels
    assert pair.difference.mean == pytest.approx(0.1)
    assert pair.difference.high - pair.difference.low < 1e-9
    assert (pair.better, pair.worse, pair.difference.count, pair.verdict) == (19, 0, 19, "better")
    assert pair.effect == 1.0 and pair.p_corrected < 0.001
    same = next(p for p in results.compare() if p.setting == "maze-10" and p.metric == "I_nav")
    assert (same.better, same.worse, same.verdict, same.needed) == (0, 0, "equal", None)


def test_less_work_is_better_and_nothing_is_starred_below_ten(results: Results) -> None:
    def lighter(row: ResultRow) -> ResultRow:
        work = 1.0 - 0.01 * (row.seed + 1) if row.policy == "better" else 1.0
        return replace(row, metrics={**row.metrics, "interaction_work_kg_m": work})

    rows = tuple(map(lighter, results.rows))
    pair = next(p for p in Results(rows).compare() if p.metric == "interaction_work_kg_m")
    assert {pair.first, pair.second} == {"plain", "better"}
    sign = 1 if pair.second == "better" else -1
    assert sign * pair.difference.mean < 0.0
    assert (pair.verdict, pair.effect) == ("better" if sign > 0 else "worse", float(sign))
    # who fails early has done less work, which is no merit
    failed = {"success": False, "reason": "wall"}
    bad = [replace(row, **(failed if row.seed < 4 else {})) for row in rows]
    fewer = next(p for p in Results(tuple(bad)).compare() if p.metric == "interaction_work_kg_m")
    assert fewer.difference.count == pair.difference.count - 4
    few = Results(tuple(row for row in rows if row.seed < 9)).compare()
    assert {p.verdict for p in few} == {"equal", "not separated"}
    assert all(p.needed is None or p.needed >= 10 for p in few)


def test_the_paired_table_says_what_its_rows_are(results: Results) -> None:
    tables = results.tables(settings=True)
    table = next(t for t in tables if t.title == "Paired differences: maze, 5 boxes")
    assert table.note.startswith("second policy minus first")
    line = next(cells for cells in table.cells if cells[0] == "E_nav")
    assert line[1] == "better - plain" and line[2] == "+0.061 *"


def test_a_mean_that_the_test_contradicts_is_pointed_out(results: Results) -> None:
    def mostly_better(row: ResultRow) -> ResultRow:
        shift = 0.0 if row.policy == "plain" else -0.5 if row.seed == 3 else 0.01
        score = 0.6 + 0.001 * row.seed + shift
        return replace(row, metrics={**row.metrics, "E_nav": score})

    mixed = Results(tuple(map(mostly_better, results.rows)))
    pair = next(p for p in mixed.compare() if p.metric == "E_nav")
    assert pair.significant and pair.effect * pair.difference.mean < 0.0
    notes = [table.note for table in mixed.tables(settings=True) if "Paired" in table.title]
    said = "mean and test point in different directions in E_nav of plain - better: few large"
    assert all(said in note for note in notes) and notes
    assert not any(said in table.note for table in results.tables(settings=True))


def test_several_settings_have_one_aggregate(results: Results) -> None:
    tables = results.tables(wide=True, settings=True)
    table = next(t for t in tables if t.title == "Interquartile means of all 2 settings")
    assert [row[0] for row in table.cells] == ["plain", "better"]
    assert table.cells[0][2] == ""  # over itself


def test_all_settings_together_come_first_and_each_on_request(results: Results) -> None:
    first, *rest = [table.title for table in results.tables(settings=True)]
    assert first == "All 2 settings together" and "maze, 5 boxes" in rest
    pooled = results.tables()
    assert [table.title for table in pooled] == [first, f"Paired differences: {first}"]
    assert [row[1] for row in pooled[0].cells] == ["40", "39 of 40\n1 failed"]
    assert {row[4].split(" / ")[2] for row in pooled[1].cells} == {"38", "39"}


@pytest.mark.usefixtures("empty_figures")
def test_policies_are_compared_with_the_first_one_unless_asked_for(tmp_path: Path) -> None:
    rows = [row for place, name in enumerate("abc") for row in rows_of(name, 0.1 * place)]
    results = Results(tuple(rows), {"policies": {name: name for name in "bac"}})
    assert {(p.first, p.second) for p in results.compare()} == {("b", "a"), ("b", "c")}
    every = {(p.first, p.second) for p in results.compare("all")}
    assert every == {("b", "a"), ("b", "c"), ("a", "c")}
    results.report(tmp_path, pairs="all")
    assert ",a,c," in (tmp_path / "differences.csv").read_text()
    with pytest.raises(InvalidInputError, match="all, first"):
        results.compare("some")


def test_a_sweep_fits_on_a_screen() -> None:
    rows = [
        row
        for value in range(10)
        for setting in ("maze-5", "maze-10")
        for row in rows_of(f"pushes@push_weight-{value}", 0.01 * value, setting=setting)
    ]
    lines = Results(tuple(rows)).table().splitlines()
    assert len(lines) <= 30
    assert sum("pushes@push_weight-9 - pushes@push_weight-0" in line for line in lines) == 1


def test_the_table_shows_means_spreads_and_intervals(results: Results) -> None:
    table = results.table(settings=True)
    better = next(s for s in results.summary() if s.policy == "better").metrics["E_nav"]
    assert f"{better.mean:.3f} ± {better.sd:.3f}" in table
    assert f"[{better.low:.3f}, {better.high:.3f}]" in table
    assert "better - plain" in table and "1 failed" in table
    assert max(map(len, results.table(width=90, settings=True).splitlines())) <= 90


@pytest.mark.slow
def test_report_files(results: Results, monkeypatch: pytest.MonkeyPatch) -> None:
    page = results.report()
    folder = page.parent
    with (folder / "summary.csv").open() as file:
        lines = list(csv.DictReader(file))
    line = next(x for x in lines if x["policy"] == "plain" and x["metric"] == "E_nav")
    plain = next(s for s in results.summary() if s.policy == "plain").metrics["E_nav"]
    assert (float(line["mean"]), float(line["low"])) == (plain.mean, plain.low)
    assert "| better |" in (folder / "summary.md").read_text()
    for name in (
        "intervals.svg",
        "tradeoff.svg",
        "scores.svg",
        "profiles.svg",
        "planning_time.svg",
    ):
        assert "mine.py:Better" in (folder / name).read_text()  # where it comes from
    before = (folder / "differences.csv").read_bytes()
    leave_figures_empty(monkeypatch)
    results.report()
    assert (folder / "differences.csv").read_bytes() == before


def test_intervals_are_drawn_as_the_tables_have_them(results: Results) -> None:
    figure = results.figure("intervals")
    assert figure.get_figwidth() == pytest.approx(4.75)  # the text of an article
    panels = {axes.get_xlabel(): axes for axes in figure.axes}
    for name, axes in panels.items():
        for summary, bar in zip(results.summary(), axes.containers, strict=True):
            found = summary.success if name == "success" else summary.metrics[name]
            (segment,) = bar.lines[2][0].get_segments()
            assert segment[:, 0].tolist() == pytest.approx([found.low, found.high])
    markers = {bar.lines[0].get_marker() for bar in panels["success"].containers}
    assert len(markers) == len(results.policies)  # told apart in print without colour


@pytest.mark.slow
def test_figures_for_a_paper(results: Results, capsys: pytest.CaptureFixture[str]) -> None:
    assert results.path is not None
    for formats, code in (("pdf,png", 0), ("gif", 2)):
        options = ["--replays", "none", "--figures", formats]
        assert main(["report", str(results.path), *options]) == code
    assert (results.path / "intervals.pdf").read_bytes().startswith(b"%PDF")
    assert (results.path / "tradeoff.png").is_file()
    assert "pdf" in capsys.readouterr().err


def test_tables_for_documents(results: Results, capsys: pytest.CaptureFixture[str]) -> None:
    folder = str(results.path)
    better = next(s for s in results.summary() if s.policy == "better").metrics["E_nav"]
    assert main(["report", folder, "--settings", "--format", "markdown"]) == 0
    assert f"{better.mean:.3f} ± {better.sd:.3f}<br>[" in capsys.readouterr().out
    assert main(["report", folder, "--settings", "--format", "latex"]) == 0
    text = capsys.readouterr().out
    assert rf"{better.mean:.3f} $\pm$ {better.sd:.3f}\\{{}}[" in text
    assert (
        text.count(r"\begin{table}")
        == text.count(r"\end{table}")
        == len(results.tables(settings=True))
    )
    for line in text.splitlines():
        assert line.count("&") in (0, line.count(r"\&") + line.rstrip("\\").count(" & "))


def test_the_page_needs_no_network_and_no_name_is_code(tmp_path: Path) -> None:
    bad = "</script><script>alert(1)</script>"
    rows = [replace(row, reason=bad, task="maze") for row in rows_of("plain", 0.0, 3, bad)]
    about = {"policies": {"plain": bad}, "settings": {rows[0].setting: bad}}
    text = Results(tuple(rows), about).report(tmp_path).read_text()
    assert "<script>alert" not in text and "src=" not in text.replace("{ src:", "")
    assert not re.search(r"https?://(?!www.w3.org|purl.org|creativecommons.org)", text)


@pytest.mark.usefixtures("empty_figures")
def test_one_policy_and_one_episode_are_enough(tmp_path: Path) -> None:
    lonely = Results(tuple(rows_of("plain", 0.0, 1)))
    assert "0.627" in lonely.table() and "±" not in lonely.table()
    assert lonely.report(tmp_path).is_file()


def test_no_results_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="holds no results"):
        Results.load(tmp_path)


@pytest.mark.usefixtures("empty_figures")
@pytest.mark.slow
def test_page_csv_and_database_of_a_folder_say_the_same(tmp_path: Path) -> None:
    many = bench("smoke", ["straight", "random"], episodes=4, workers=0, out=tmp_path)
    many.report()
    few = bench("smoke", ["straight"], episodes=2, workers=0)
    with pytest.raises(InvalidInputError, match=f"{tmp_path}.*another folder"):
        few.report(tmp_path)
    assert f"episodes {len(many.rows)}" in (tmp_path / "report.html").read_text()
    assert len((tmp_path / "results.csv").read_text().splitlines()) == len(many.rows) + 1

    few.report(tmp_path / "few")
    assert len((tmp_path / "few" / "results.csv").read_text().splitlines()) == len(few.rows) + 1
    with pytest.raises(InvalidInputError, match="is no run directory"):
        bench("smoke", ["straight"], episodes=3, workers=0, out=tmp_path / "few")
    folder = tmp_path / "longer"
    bench("smoke", ["straight"], episodes=2, workers=0, out=folder).report()
    bench("smoke", ["straight"], episodes=3, workers=0, out=folder)
    assert not (folder / "report.html").exists()  # it was about other rows
    with pytest.raises(InvalidInputError, match="another folder"):
        few.report(folder)
    Results.load(folder).report()
