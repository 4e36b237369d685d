"""The fenced blocks of README.md and docs/*.md, and which of them are not run, for a reason that stands before them:

    <!-- not run: needs ROS -->
    ```sh
    ros2 launch touchup cell.launch.py
    ```
"""

import collections
import re
from dataclasses import dataclass

from conftest import ROOT

OTHERS = ["README.md", "crates/touchup-python/README.md", "examples/sweep/README.md"]
PAGES = [*(ROOT / page for page in OTHERS), *sorted((ROOT / "docs").glob("*.md"))]

# kinds of blocks; output of programs, formulas and drawings do not run
RUN, OUTPUT = {"sh", "console", "python", "yaml", "json", "rust"}, {"text"}

# permitted reasons against running a block of commands or code, each with the pattern that the block must have: without it the mark is
# unnecessary
REASONS = {
    "needs ROS": r"\bros2 |/opt/ros|colcon",
    "needs Ray": r"\btouchup\.ray\b",
    "needs a UR arm": r"rtde_receive|UrArm",
    "installs packages": r"\b(apt|pip|cargo) install|\bur setup",
    "changes the system": r"\bsudo ",
    "takes minutes": r"touchup-report",
    "runs until it is stopped": r"--web\b|touchup node|ur_controller",
}
BLOCK = re.compile(
    r"^(?P<indent> *)```(?P<info>[^\n`]*)\n(?P<code>.*?)^(?P=indent)```$",
    re.DOTALL | re.MULTILINE,
)
MARK = re.compile(r"<!-- not run: (.+?) -->$")


@dataclass(frozen=True)
class Block:
    page: str
    line: int
    # sh, python, …; empty for a fence without a name
    kind: str
    options: tuple[str, ...]
    code: str
    # why it is not run
    mark: str | None

    def __str__(self):
        return f"{self.page}:{self.line}"

    @property
    def is_run(self):
        return self.kind in RUN and self.mark is None


def blocks_of(page):
    text = page.read_text(encoding="utf-8")
    found = []
    for match in BLOCK.finditer(text):
        before = text[: match.start()].rstrip("\n").rpartition("\n")[2].strip()
        mark = MARK.match(before)
        kind, *options = match["info"].strip().split(",")
        code = "".join(line.removeprefix(match["indent"]) for line in match["code"].splitlines(keepends=True))
        line = text.count("\n", 0, match.start()) + 1
        found.append(Block(page.relative_to(ROOT).as_posix(), line, kind, tuple(options), code, mark and mark[1]))
    return found


def marks_of(page):
    """Number of marks anywhere on the page."""
    return page.read_text(encoding="utf-8").count("<!-- not run")


def problem(block):
    """Fault of the mark of a block, or of its lack; None without a fault."""
    if not block.kind:
        return "its fence names no language: sh, python, yaml, …, or text for what a program prints"
    if block.kind in OUTPUT:
        return block.mark and "what a program prints is never run: its mark is not needed"
    if block.kind not in RUN:
        return f"nothing is known of the language {block.kind}"
    if block.mark is None:
        return "ignore" in block.options and "code that the compiler ignores needs a mark with its reason" or None
    if block.mark not in REASONS:
        return f'"{block.mark}" is none of the reasons {", ".join(REASONS)}'
    if not re.search(REASONS[block.mark], block.code):
        return f'it has nothing that "{block.mark}" would be said of: its mark is not needed'
    return None


def counts():
    """Numbers of executed blocks of each kind, and of the others by reason: a line each."""
    blocks = [block for page in PAGES for block in blocks_of(page)]
    kinds = collections.Counter(block.kind for block in blocks if block.is_run)
    reasons = collections.Counter(block.mark for block in blocks if block.mark)
    return [
        f"{sum(kinds.values())} blocks of the docs run: " + ", ".join(f"{n} {kind}" for kind, n in kinds.most_common()),
        *(f"{n} not run: {reason}" for reason, n in reasons.most_common()),
        f"{sum(block.kind in OUTPUT for block in blocks)} are what a program prints, or no code",
    ]
