"""Shared by the tests of this folder: the binary, the shared data, the judge.

`tests/all.sh` sets TOUCHUP_BIN; without it the tests use the release binary of `target/`. A test skips with the reason if data or system
packages are missing. The mark `full` names a slow proof, for the shards of tests/shards.sh (TOUCHUP_FULL); without the variable pytest does
not select it, and does not read files that need its Python packages.
"""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
IS_FULL = bool(os.environ.get("TOUCHUP_FULL"))
collect_ignore = [] if IS_FULL else ["test_ros_rviz.py", "test_ros_fastdds_network.py", "test_ros_network.py", "test_docs_site.py"]


def pytest_configure(config):
    config.addinivalue_line("markers", "full: a slow proof, for tests/shards.sh")


def pytest_collection_modifyitems(config, items):
    if IS_FULL:
        return
    slow = [item for item in items if item.get_closest_marker("full")]
    config.hook.pytest_deselected(items=slow)
    items[:] = [item for item in items if item not in slow]


def pytest_assertrepr_compare(op, left, right):
    """Short report of differing files: pytest would show every line of a difference of a megabyte, which takes half an hour."""
    if op == "==" and isinstance(left, bytes) and isinstance(right, bytes):
        first = next((place for place, (a, b) in enumerate(zip(left, right, strict=False)) if a != b), min(len(left), len(right)))
        part = slice(max(first - 20, 0), first + 20)
        return [f"{len(left)} bytes == {len(right)} bytes", f"first other one at {first}: {left[part]!r} and {right[part]!r}"]
    return None


def pytest_terminal_summary(terminalreporter):
    """Prints the number of executed blocks of the documentation, if any."""
    reports = [report for reports in terminalreporter.stats.values() for report in reports]
    if any("test_docs_code.py" in getattr(report, "nodeid", "") for report in reports):
        import doc_blocks

        terminalreporter.section("blocks of the documentation")
        terminalreporter.write("\n".join([*doc_blocks.counts(), ""]))


@pytest.fixture(scope="session")
def touchup_bin():
    """Path of the release binary."""
    path = Path(os.environ.get("TOUCHUP_BIN", ROOT / "target/release/touchup"))
    assert path.is_file(), f"{path} is not there: run cargo build --release"
    return path


@pytest.fixture(scope="session")
def touchup(touchup_bin):
    """Runs the binary: touchup("refine", "--scan", ..., input="") -> CompletedProcess with text output."""

    def run(*arguments, **options):
        options = {"capture_output": True, "text": True, "timeout": 600, **options}
        return subprocess.run([str(touchup_bin), *map(str, arguments)], **options)

    return run


@pytest.fixture(scope="session")
def demo_folder(touchup, tmp_path_factory):
    """Output of `touchup demo`: truth, scan and 74 s of touches, and their refinement. No test writes there."""
    out = tmp_path_factory.mktemp("demo")
    done = touchup("demo", "--out", out)
    assert done.returncode == 0, done.stderr
    return out


@pytest.fixture(scope="session")
def begun(demo_folder, tmp_path_factory):
    """The first 20 s of the touches of the demo: its edges, two sides of the plate, and the boss."""
    from part_of_recording import first_seconds

    return first_seconds(demo_folder / "touch.mcap", 20, tmp_path_factory.mktemp("begun") / "touch.mcap")


@pytest.fixture(scope="session")
def shared():
    """Path of ../shared."""
    path = ROOT.parent / "shared"
    if not path.is_dir():
        pytest.skip("../shared is missing")
    return path


@pytest.fixture(scope="session")
def judge(shared):
    """Path of the judge's script."""
    return shared / "judge" / "judge.py"


@pytest.fixture(scope="session")
def browser():
    """Debian's chromium, for the tests of one process."""
    from browser import ARGUMENTS
    from playwright.sync_api import sync_playwright

    program = shutil.which("chromium")
    if not program:
        pytest.skip("the page is shown by a browser (Debian: apt-get install chromium)")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=ARGUMENTS)
        yield browser
        browser.close()
