"""The tables of docs/ros.md: the one place that names topics, services, parameters and frames."""

import re

from conftest import ROOT


def table(*head):
    """Rows of the table whose head begins with these columns, as dicts by column."""
    text = (ROOT / "docs/ros.md").read_text()
    found = re.search(rf"^\| {re.escape(' | '.join(head))} \|.*?(?=\n\n|\Z)", text, re.MULTILINE | re.DOTALL)
    assert found, f"docs/ros.md has no table that begins with {head}"
    cells = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in found[0].strip().splitlines()]
    return [dict(zip(cells[0], row, strict=True)) for row in cells[2:]]


def code(cell):
    """Text between code marks."""
    return re.findall(r"`([^`]+)`", cell)


def published():
    """Rows of the topics that the node publishes, by name."""
    return {code(row["topic"])[0]: row for row in table("topic", "type", "reliability")}
