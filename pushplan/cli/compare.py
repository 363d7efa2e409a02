"""``pushplan compare``: two runs beside each other, as a gate."""

from __future__ import annotations

import argparse
from dataclasses import asdict

from pushplan.cli.common import say, say_json

_DEFAULT = "success<-0.0,E_nav<-0.0,I_nav<-0.0,S_manip<-0.0,E_manip<-0.0,I_manip<-0.0"


def run(options: argparse.Namespace) -> int:
    """Judge, print the verdicts."""
    from pushplan.evaluation import compare_runs
    from pushplan.evaluation.report.comparing import verdict_table
    from pushplan.evaluation.report.table_formats import text

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
