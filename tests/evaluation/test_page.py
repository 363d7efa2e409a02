"""The page of a run, in a real browser: what one clicks, types and sees."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import leave_figures_empty
from synthetic_rows import many_rows

from pushplan.cli import main
from pushplan.evaluation import Job, Results, bench, parse_policy, run_batch
from pushplan.evaluation.report.page import chosen, page_data
from pushplan.scenarios import suite

api = pytest.importorskip("playwright.sync_api", reason="needs Playwright")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")
POLICIES = ["straight", "random", "kinodynamic-rrt"]
LINES = "#matrix tbody tr:not(.space)"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("page") / "run"
    results = bench("maze-2d-3", POLICIES, episodes=3, workers=0, out=out)
    with pytest.MonkeyPatch.context() as patch:
        leave_figures_empty(patch)
        results.report()
    return out


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with api.sync_playwright() as play:
        found = play.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield found
        found.close()


class Opened:
    """A page, and everything that went wrong in it."""

    def __init__(self, browser: Any, file: Path, **options: Any) -> None:
        self.page = browser.new_context(**options).new_page()
        self.wrong: list[str] = []
        self.asked: list[str] = []
        self.page.on("pageerror", lambda error: self.wrong.append(str(error)))
        self.page.on("console", lambda m: m.type == "error" and self.wrong.append(m.text))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(file.as_uri())
        self.page.wait_for_selector("#matrix tbody td.missed, #matrix tbody td:nth-child(2)")

    def cells(self, column: int) -> list[str]:
        cells = self.page.locator(f"{LINES} td:nth-child({column})").all()
        return [cell.inner_text() for cell in cells]

    def state(self, text: str) -> Any:
        return self.page.evaluate(text)


@pytest.fixture
def opened(browser: Any, folder: Path) -> Iterator[Opened]:
    one = Opened(browser, folder / "report.html")
    yield one
    assert one.wrong == []
    assert all(url.startswith("file:") for url in one.asked)


@pytest.mark.slow
def test_filters_and_sorting(opened: Opened) -> None:
    page = opened.page
    assert opened.cells(2) == ["success"] * 3
    page.locator("#outcome").select_option("differ")
    assert page.locator("#count").inner_text() == "3 of 3 scenarios"
    page.keyboard.press("/")
    page.keyboard.type("52cbe2a8-1")
    assert page.locator("#count").inner_text() == "1 of 3 scenarios"
    page.locator("#find").fill("")
    page.locator("#measure").select_option("I_nav")
    page.locator("#matrix th button", has_text="random").click()
    values = [float(text.split()[0]) for text in opened.cells(3)]
    assert values == sorted(values, reverse=True) and len(set(values)) > 1
    page.locator("#matrix th button", has_text="random").click()
    assert [float(text.split()[0]) for text in opened.cells(3)] == sorted(values)


@pytest.mark.slow
def test_a_table_sorts_by_its_numbers(opened: Opened) -> None:
    table = opened.page.locator("#scores table").first
    table.locator("th button", has_text="I_nav").click()
    texts = [row.inner_text().split() for row in table.locator("tbody tr").all()]
    assert sorted(line[0] for line in texts) == sorted(POLICIES)
    column = [row.locator("td").nth(4).inner_text() for row in table.locator("tbody tr").all()]
    values = [float(text.split()[0]) for text in column]
    assert values == sorted(values, reverse=True)


def test_an_episode_is_played_beside_another_in_step(opened: Opened, folder: Path) -> None:
    page = opened.page
    page.locator(f"{LINES} td:nth-child(2)").first.click()
    page.wait_for_function("player.views.length === 2")
    first = opened.state("player.views[0].replay.job")
    row = next(row for row in Results.load(folder).rows if row.job == first)
    episode = Results.load(folder).episode(row)
    assert episode is not None
    view = opened.state(
        "(({poses, frames, times}) => [0, 1, 2].map((axis) =>"
        " Array.from(poses.slice(axis * frames, (axis + 1) * frames))).concat([times]))"
        "(player.views[0].replay)"
    )
    instants = episode.times - episode.times[0]
    whole = [np.interp(view[3], instants, episode.robot_poses[:, axis]) for axis in (0, 1)]
    assert np.abs(np.array(view[:2]) - whole).max() < 2e-3
    before = opened.state("player.views.map((view) => view.canvas.toDataURL())")
    planned = opened.state("player.views.findIndex((view) => view.replay.plans.length > 0)")
    page.evaluate("$('time').value = 500; $('time').dispatchEvent(new Event('input'))")
    assert opened.state("player.time") == pytest.approx(opened.state("player.end") / 2)
    after = opened.state("player.views.map((view) => view.canvas.toDataURL())")
    assert before[0] != after[0] and before[1] != after[1]
    job, starts = opened.state(
        "(({job, plans}) => [job, plans.map((plan) => plan.time)])"
        f"(player.views[{planned}].replay)"
    )
    planner = Results.load(folder).episode(
        next(row for row in Results.load(folder).rows if row.job == job)
    )
    assert planner is not None and planner.plans is not None
    assert starts == pytest.approx(planner.plans.times - planner.times[0], abs=1e-3)
    page.locator("h1").click()
    page.keyboard.press("p")
    assert opened.state(f"player.views[{planned}].canvas.toDataURL()") != after[planned]
    page.keyboard.press("p")
    assert opened.state("player.views.map((view) => view.canvas.toDataURL())") == after
    page.keyboard.press("Space")
    page.wait_for_function(f"player.time > {opened.state('player.end') / 2}")
    page.keyboard.press("Space")
    assert opened.state("player.playing") is False


def test_the_highlighted_cell_stays_that_of_the_replay(opened: Opened) -> None:
    page = opened.page
    page.locator("#measure").select_option("I_nav")
    page.locator(f"{LINES} td:nth-child(3)").nth(1).click()
    page.wait_for_function("player.views.length === 2")
    line = (
        "({ key: player.one.key, policy: player.views[0].policy, job: player.views[0].replay.job })"
    )
    replayed = opened.state(line)

    def highlighted() -> list[tuple[str, int]]:
        cells = page.locator("#matrix td.chosen").all()
        key = "e => [e.parentNode.firstChild.innerText, e.cellIndex - 1]"
        return [tuple(cell.evaluate(key)) for cell in cells]

    order = [opened.cells(1)]
    for heading in ("scenario", "straight", "random", "random", "scenario"):
        page.locator("#matrix th button", has_text=heading).click()
        assert highlighted() == [(replayed["key"], replayed["policy"])]
        assert opened.state("state.chosen") == replayed["job"]
        order.append(opened.cells(1))
    assert len({*map(tuple, order)}) > 1
    other = next(key for key in order[0] if key != replayed["key"])
    page.locator("#find").fill(other)
    assert highlighted() == []  # it is not among those that are shown
    page.locator("#find").fill("")
    page.locator("#matrix").focus()
    page.keyboard.press("ArrowDown")  # moves the cursor, not the replay
    assert highlighted() == [(replayed["key"], replayed["policy"])]
    assert opened.state(line) == replayed


@pytest.mark.slow
def test_keys_move_in_the_matrix_and_choose(opened: Opened) -> None:
    at = "[state.shown.indexOf(state.one), state.column]"
    assert opened.state(at) == [0, 1]  # who has no success comes first
    opened.page.locator("#matrix").focus()
    for key in ("ArrowDown", "ArrowDown", "ArrowUp", "ArrowRight", "ArrowLeft", "Enter"):
        opened.page.keyboard.press(key)
    assert opened.state(at) == [1, 1]
    assert "random" in opened.page.locator("#chosen").inner_text()
    opened.page.locator("h1").click()
    ground = "getComputedStyle(document.body).backgroundColor"
    light = opened.state(ground)
    opened.page.keyboard.press("d")
    assert opened.state(ground) != light


@pytest.mark.parametrize(
    ("width", "scheme"),
    [(390, "dark"), pytest.param(1280, "light", marks=pytest.mark.slow)],
)
def test_nothing_is_cut_off(browser: Any, folder: Path, width: int, scheme: str) -> None:
    one = Opened(
        browser,
        folder / "report.html",
        viewport={"width": width, "height": 800},
        color_scheme=scheme,
    )
    assert one.state("document.documentElement.scrollWidth") <= width
    assert one.state("isDark()") == (scheme == "dark")


@pytest.mark.usefixtures("empty_figures")
@pytest.mark.slow
def test_printed_tables_keep_their_columns(browser: Any, tmp_path: Path) -> None:
    results = many_rows(24, 3)
    long = [replace(row, policy=f"{'a_very_long_name@' * 3}{row.policy}") for row in results.rows]
    page = Results(tuple(long)).report(tmp_path, replays="none", pairs="all")
    one = Opened(browser, page, viewport={"width": 1040, "height": 720})  # A4, landscape
    one.page.emulate_media(media="print")
    for table in one.page.locator(".scroll table").all():
        box = table.bounding_box()
        assert box is not None and box["x"] + box["width"] <= 1040
    assert one.page.locator(".scroll").first.evaluate("e => getComputedStyle(e).overflowX") == (
        "visible"
    )


def test_single_episodes_of_several_tasks(browser: Any, tmp_path: Path) -> None:
    tasks = {"maze-2d-3": "straight", "ship-ice-2d-10": "random"}
    jobs = [
        Job(parse_policy(policy), suite(name, episodes=1).scenarios[0])
        for name, policy in tasks.items()
    ]
    run_batch(jobs, out=tmp_path, workers=0)
    results = Results.load(tmp_path)
    names = [label.get_text() for label in results.figure("intervals").axes[0].get_yticklabels()]
    # each only in its own task, below the heading of that
    assert [name in tasks.values() for name in names] == [False, True, False, True]
    assert names[1::2] == ["straight", "random"]
    one = Opened(browser, results.report(), viewport={"width": 390, "height": 800})
    assert not list(tmp_path.glob("*.svg"))
    assert one.page.locator("#figures").count() == 0
    one.page.wait_for_function("player.views.length === 1 && player.time === player.end")
    assert one.state("document.documentElement.scrollWidth") <= 390
    assert one.wrong == []


@pytest.mark.slow
def test_replays_beside_the_page(browser: Any, folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder, tmp_path / "run")
    assert main(["report", str(tmp_path / "run"), "--replays", "beside", "--replay-most", "6"]) == 0
    assert len(list((tmp_path / "run" / "replays").iterdir())) == 6
    one = Opened(browser, tmp_path / "run" / "report.html")
    one.page.locator(f"{LINES} td:nth-child(2)").first.click()
    one.page.wait_for_function("player.views.length === 2")
    assert main(["report", str(tmp_path / "run"), "--replays", "none"]) == 0
    bare = Opened(browser, tmp_path / "run" / "report.html")
    bare.page.locator(f"{LINES} td:nth-child(2)").first.click()
    assert "No replay" in bare.page.locator("#chosen").inner_text()
    assert bare.page.locator("#player").is_hidden()


@pytest.mark.slow
def test_ten_thousand_rows_stay_usable(browser: Any, tmp_path: Path) -> None:
    page = many_rows(10_000).report(tmp_path)
    assert page.stat().st_size < 5e6
    one = Opened(browser, page)
    assert one.state("performance.now()") < 5000.0
    assert one.page.locator("#count").inner_text() == "2000 of 2000 scenarios"
    assert one.page.locator("#matrix tbody tr").count() < 60
    began = one.state("performance.now()")
    one.page.locator("#find").fill("suite-3")
    assert one.page.locator("#count").inner_text() == "500 of 2000 scenarios"
    one.page.locator("#matrix").evaluate("box => { box.scrollTop = 1e6; }")
    one.page.wait_for_function("document.querySelector('#matrix').innerText.includes('suite-3-')")
    assert one.state("performance.now()") - began < 3000.0
    assert one.wrong == []


def test_failures_come_first_and_replays_are_of_whole_scenarios(folder: Path) -> None:
    results = Results.load(folder)
    assert len(chosen(results, 40)) == 9
    assert [row.scenario for row in chosen(results, 5)] == [results.rows[0].scenario] * 3
    broken = [
        replace(row, status="crashed", success=False) if row.seed == 2 else row
        for row in results.rows
    ]
    assert {row.seed for row in chosen(replace(results, rows=tuple(broken)), 3)} == {2}
    data = page_data(results, {})
    assert len(data["rows"]["policy"]) == 9 and data["policies"] == POLICIES
