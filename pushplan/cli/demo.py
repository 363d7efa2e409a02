"""``pushplan demo``: one episode of three tasks, and a page that replays them."""

from __future__ import annotations

import argparse
import os
import sys

from pushplan.cli.common import has_screen, say
from pushplan.cli.output_files import check_directory
from pushplan.cli.progress import progress_of

EPISODES = {
    "namo-2d-one-box": "namo",
    "ship-ice-2d-10": "skeleton",
    "area-clearing-2d-10-clear-small": "greedy",
}
"""Suite -> the policy that is shown in its first start: quick ones."""
_MOST_WORKERS = 3


def run(options: argparse.Namespace) -> int:
    """Run the episodes, say how they ended, write the page and open it."""
    import webbrowser

    from pushplan.cli.report import exit_code
    from pushplan.evaluation import Job, Results, parse_policy, run_batch
    from pushplan.imports.on_demand import need
    from pushplan.scenarios import suite

    check_directory(options.out)
    for library in ("gymnasium", "pymunk", "rich", "jinja2", "matplotlib"):
        need(library)  # before the work, not after it
    jobs = [
        Job(parse_policy(policy), scenario)
        for name, policy in EPISODES.items()
        for scenario in suite(name, episodes=1).scenarios
    ]
    say(f"{len(EPISODES)} episodes:")
    with progress_of(options.out) as progress:
        workers = min(os.cpu_count() or 1, _MOST_WORKERS)
        about = {"suite": "demo"}
        run_batch(jobs, out=options.out, workers=workers, about=about, progress=progress)
    results = Results.load(options.out)
    page = results.report()
    for row in results.rows:
        how = "success" if row.success else row.reason
        if row.interaction_work_kg_m is not None:  # a job that failed has none
            how += f", work {row.interaction_work_kg_m:.3g} kg m"
        say(f"  {row.policy} in {row.task}: {how}")
    say(f"page: {page}")
    if not options.no_open and sys.stdout.isatty() and has_screen():  # no browser in the terminal
        webbrowser.open(page.absolute().as_uri())
    return exit_code(results)
