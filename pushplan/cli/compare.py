"""``pushplan compare``: two runs beside each other, as a gate."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from typing import Any

from pushplan.cli.common import add_command, say, say_json

_EXAMPLES = """\
  pushplan compare runs/main runs/branch
  pushplan compare main.csv runs/branch --fail-on "E_nav<-0.02,plan_time>+20%"

A rule names a column, a direction and the change that is too much, in the column's unit or in
percent of the old mean. Exit code 1: a rule says "regressed", or results are missing; with --strict
also "unclear".
"""
_DEFAULT = "success<-0.0,E_nav<-0.0,I_nav<-0.0,S_manip<-0.0,E_manip<-0.0,I_manip<-0.0"


def add(commands: Any) -> None:
    """Add the command."""
    parser = add_command(commands, "compare", "two runs beside each other", _EXAMPLES, run)
    parser.add_argument("old", metavar="OLD", help="run directory or results.csv")
    parser.add_argument("new", metavar="NEW", help="the same")
    parser.add_argument("--fail-on", metavar="RULES", help="rules with commas between them")
    parser.add_argument("--strict", action="store_true", help="also fail where it is unclear")
    parser.add_argument("--json", action="store_true", help="print the verdicts as JSON")


def run(options: argparse.Namespace) -> int:
    """Judge, print the verdicts."""
    from pushplan.evaluation import compare_runs
    from pushplan.evaluation.comparing import verdict_table
    from pushplan.evaluation.table_formats import text

    verdicts = compare_runs(options.old, options.new, options.fail_on or _DEFAULT)
    if options.json:
        say_json([{**asdict(one), "rule": str(one.rule)} for one in verdicts])
    else:
        for setting in dict.fromkeys(one.setting for one in verdicts):
            say(setting)
            say(text([verdict_table([one for one in verdicts if one.setting == setting])]))
    if options.fail_on is None:
        return 0
    bad = [v for v in verdicts if v.failed or (options.strict and v.verdict == "unclear")]
    return 1 if bad else 0
