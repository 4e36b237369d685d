#!/usr/bin/env python3
"""Writes the section of one shard into docs/results.md: tests/results.py K/N FOLDER

FOLDER has the reports of the shard, and `section.tsv`: its title, then for each output that belongs into the section the test that
printed it (`text`, `markdown`) or its place (`file`), and a heading. The sections of other shards stay as they are.
"""

import csv
import datetime
import platform
import re
import subprocess
import sys
import xml.etree.ElementTree as tree
from pathlib import Path

from count import cases_below

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/results.md"
HEAD = """# Results

Written by the slow proofs, a section by each shard: `tests/all.sh --shard K/N` replaces one, `tests/all.sh --full` all of them; do not edit.
The program's own simulator shows consistency, not truth: the judged cases and the machined parts come from other programs.
"""


def lines_of(*command):
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def printed_by(test, reports):
    """The output of a test, by the end of its name; of one with parameters, that of the first."""
    for report in reports:
        for case in tree.parse(report).iter("testcase"):
            if f"{case.get('classname', '')}::{case.get('name')}".partition("[")[0].endswith(test):
                text = "".join(out.text or "" for out in case.iter("system-out"))
                # libtest frames the output of its one test, and names tests longer than a minute
                text = re.sub(r"^test \S+ has been running for over .*\n", "", text, flags=re.MULTILINE)
                inner = re.search(r"^running 1 test\n(.*?)^test \S+ \.\.\. ", text, re.DOTALL | re.MULTILINE)
                return (inner[1] if inner else re.sub(r"^-+ Captured .*-+\n", "", text, flags=re.MULTILINE)).strip("\n")
    raise SystemExit(f"{test} is in no report of this shard: tests/shards.sh names it")


def section(shard, folder):
    """Heading, origin and outputs of a shard, as Markdown."""
    reports = sorted(folder.glob("*.xml"))
    with open(folder / "section.tsv", newline="") as lines:
        (_, title), *proofs = csv.reader(lines, delimiter="\t")
    commit = lines_of("git", "rev-parse", "--short=12", "HEAD")
    if lines_of("git", "status", "--porcelain", "--untracked-files=no", "--", ".", ":!docs/results.md"):
        commit += ", with changes"
    model = re.search(r"^model name\s*: (.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    cores = lines_of("nproc")
    cases = list(cases_below(folder))
    outcomes, seconds = [case[2] for case in cases], sum(case[1] for case in cases)
    text = [
        f"## {title}",
        "",
        f"`tests/all.sh --shard {shard}`, {datetime.date.today()}, commit {commit}, {model[1] if model else platform.machine()} with {cores} processors: "
        f"{outcomes.count('passed')} passed, {outcomes.count('failed')} failed, {outcomes.count('skipped')} skipped, in {seconds:.0f} s one after another.",
    ]
    for kind, source, heading in proofs:
        output = Path(source).read_text().strip() if kind == "file" else printed_by(source, reports)
        if not output:
            raise SystemExit(f"{source} printed nothing")
        text += ["", f"### {heading}", ""]
        text += [f"`{source}`", ""] if kind != "file" else []
        text += [output] if kind == "markdown" else ["```text", output, "```"]
    return "\n".join(text) + "\n"


def main():
    shard, folder = sys.argv[1], Path(sys.argv[2])
    number = int(shard.split("/")[0])
    parts = re.split(r"^<!-- shard (\d+) -->\n", PAGE.read_text() if PAGE.exists() else HEAD, flags=re.MULTILINE)
    sections = {int(own): text.strip("\n") + "\n" for own, text in zip(parts[1::2], parts[2::2], strict=True)}
    sections[number] = section(shard, folder)
    PAGE.write_text("\n".join([HEAD, *(f"<!-- shard {own} -->\n{text}" for own, text in sorted(sections.items()))]))


if __name__ == "__main__":
    main()
