"""How long the page of a large run takes to make and to open, and how large it is.

    python -m benchmarks.speed.report_page [ROWS ...]

The rows are synthetic: five policies in four settings. Opening is measured in headless Chromium,
from navigation to the first row of the matrix; filtering from a key to the new count.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "evaluation"))
from synthetic_rows import many_rows

from benchmarks.reporting import command_line


def main() -> None:
    """Measure, write the table."""
    parser = command_line(__doc__)
    parser.add_argument("rows", nargs="*", type=int, default=[1000, 10_000, 100_000])
    counts = parser.parse_args().rows
    print("| rows | page made in | size | opens in | filtered in |")
    print("|---|---|---|---|---|")
    for count in counts:
        print(row(count), flush=True)


def row(count: int) -> str:
    """One line of the table."""
    from playwright.sync_api import sync_playwright

    results = many_rows(count)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as play:
        began = time.perf_counter()
        page = results.report(folder)
        made = time.perf_counter() - began
        chromium = shutil.which("chromium") or shutil.which("chromium-browser")
        browser = play.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        tab = browser.new_page()
        began = time.perf_counter()
        tab.goto(page.as_uri())
        tab.wait_for_selector("#matrix tbody td:nth-child(2)")
        opened = time.perf_counter() - began
        took = tab.evaluate(
            "(() => { const began = performance.now(); $('find').value = 'suite-3';"
            " $('find').dispatchEvent(new Event('input')); return performance.now() - began; })()"
        )
        size = page.stat().st_size / 1e6
        browser.close()
    return f"| {count:,} | {made:.1f} s | {size:.1f} MB | {opened:.2f} s | {took:.0f} ms |"


if __name__ == "__main__":
    main()
