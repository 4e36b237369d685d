"""What the tests of this folder share: the binary, the shared data, the judge.

`tests/all.sh` sets TOUCHUP_BIN and TOUCHUP_MISSING_PACKAGES; without it the release binary of `target/` is used.
A test whose data or system packages are missing is skipped with the reason; with CI set, missing data fail.
"""

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# proofs that take minutes: tests/all.sh --full alone collects them
collect_ignore = [] if os.environ.get("TOUCHUP_FULL") else ["test_ros_fastdds_network.py"]


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
    """What `touchup demo` writes: truth, scan and 74 s of touches, and what refine makes of them. Nobody writes there."""
    out = tmp_path_factory.mktemp("demo")
    done = touchup("demo", "--out", out)
    assert done.returncode == 0, done.stderr
    return out


@pytest.fixture(scope="session")
def shared():
    """Path of ../shared."""
    path = ROOT.parent / "shared"
    if not path.is_dir():
        if os.environ.get("CI"):
            pytest.fail(f"{path} is missing")
        pytest.skip("../shared is missing")
    return path


@pytest.fixture(scope="session")
def judge(shared):
    """Path of the judge's script; its libraries can be loaded."""
    missing = os.environ.get("TOUCHUP_MISSING_PACKAGES", "").split()
    if missing:
        pytest.skip(f"the judge needs system packages: apt-get install {' '.join(missing)}")
    return shared / "judge" / "judge.py"
