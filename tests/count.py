#!/usr/bin/env python3
"""Counts the tests of a run: tests/count.py FOLDER

FOLDER has reports in the form of JUnit (`*.xml`) and lists of tests without such a report (`notes.tsv`: passed, failed or skipped, a name,
a reason). Prints the slowest tests, failed and skipped ones, and the count as the last line; the exit code is 0 only without failures. A
test that could not run prints `SKIPPED: NAME: REASON`, and counts as skipped.
"""

import csv
import re
import sys
import xml.etree.ElementTree as tree
from pathlib import Path

SLOWEST = 30


def cases_of(report):
    """Name, seconds, outcome and reason of each test of a report."""
    for case in tree.parse(report).iter("testcase"):
        name, seconds = f"{case.get('classname', '')}::{case.get('name')}", float(case.get("time") or 0)
        printed = "".join(out.text or "" for out in case.iter("system-out"))
        skipped = case.find("skipped")
        said = re.search(r"^SKIPPED: (.*)$", printed, re.MULTILINE)
        if case.find("failure") is not None or case.find("error") is not None:
            yield name, seconds, "failed", ""
        elif skipped is not None or said:
            yield name, seconds, "skipped", skipped.get("message", "") if skipped is not None else said[1]
        else:
            yield name, seconds, "passed", ""


def cases_below(folder):
    """Those of all reports and lists below a folder."""
    for report in sorted(folder.rglob("*.xml")):
        yield from cases_of(report)
    for path in sorted(folder.rglob("notes.tsv")):
        with open(path, newline="") as lines:
            for outcome, name, reason in csv.reader(lines, delimiter="\t"):
                yield name, 0.0, outcome, reason


def main():
    cases = list(cases_below(Path(sys.argv[1])))
    slowest = sorted(cases, key=lambda case: -case[1])[:SLOWEST]
    print(f"the {len(slowest)} slowest tests of {len(cases)}, which took {sum(case[1] for case in cases):.0f} s one after another:")
    for name, seconds, *_ in slowest:
        print(f"{seconds:8.1f} s  {name}")
    for name, _, outcome, reason in cases:
        if outcome != "passed":
            print(f"{outcome}: {name}{': ' if reason else ''}{reason}")
    count = {kind: sum(case[2] == kind for case in cases) for kind in ("passed", "failed", "skipped")}
    print(", ".join(f"{number} {kind}" for kind, number in count.items()))
    return 1 if count["failed"] or not count["passed"] else 0


if __name__ == "__main__":
    sys.exit(main())
