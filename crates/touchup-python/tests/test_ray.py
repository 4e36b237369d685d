"""A sweep on Ray: the same bytes as one job after the other, for any end of its workers."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import ray
import touchup
import touchup.ray
from sweeps import command, files_of, planned, rows_of, table

DEADLINE_S = 300
KILLS = 10


@pytest.fixture(scope="module")
def jobs(ring, tmp_path_factory):
    """Two recordings; with TOUCHUP_FULL three stiffnesses and two thresholds."""
    few = {} if os.environ.get("TOUCHUP_FULL") else {"stiffnesses": [15, 20], "on_n": [0.3], "seconds": 2}
    return planned(tmp_path_factory.mktemp("sweep"), ring, **few)


@pytest.fixture(scope="module")
def serial(jobs):
    """The results of one process."""
    results = jobs.parent / "serial"
    command("sweep", "run", jobs, "--results", results)
    return results


@pytest.fixture(scope="module")
def cluster():
    ray.init(num_cpus=2, include_dashboard=False)
    yield
    ray.shutdown()


def test_two_workers_make_the_bytes_of_one_process(jobs, serial, cluster):
    seen = []
    touchup.ray.run(jobs, jobs.parent / "ray", on_done=lambda done, of: seen.append((done, of)))
    files = files_of(jobs.parent / "ray")
    assert len(files) > 3 * len(rows_of(jobs))
    assert files == files_of(serial)
    assert table(jobs, jobs.parent / "ray") == table(jobs, serial)
    count = len(rows_of(jobs))
    assert [of for _, of in seen] == [count] * len(seen) and seen[-1] == (count, count)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)


def test_what_has_its_result_is_not_run_again(jobs, serial, cluster):
    before = {path: path.stat().st_mtime_ns for path in serial.rglob("*")}
    seen = []
    touchup.ray.run(jobs, serial, on_done=lambda *numbers: seen.append(numbers))
    assert seen == []
    assert {path: path.stat().st_mtime_ns for path in serial.rglob("*")} == before


def test_a_recording_that_is_not_that_of_the_plan_is_one_clear_error(jobs, serial, cluster, tmp_path):
    for name in ("jobs.jsonl", "scan.ply", "scene.yaml", "touch_1.mcap", "touch_2.mcap"):
        (tmp_path / name).write_bytes((jobs.parent / name).read_bytes())
    (tmp_path / "touch_2.mcap").write_bytes((jobs.parent / "touch_1.mcap").read_bytes())
    with pytest.raises(touchup.TouchupError, match="touch_2.mcap") as raised:
        touchup.ray.run(tmp_path / "jobs.jsonl", tmp_path / "results")
    assert raised.value.exit_code == 3 and "Traceback" not in str(raised.value)


@pytest.mark.full
def test_ten_killed_workers_change_nothing(jobs, serial, cluster):
    killed = []
    ends = threading.Event()

    def kill():
        """Kills a worker while it has a job, again and again: Ray names its processes by their tasks."""
        while len(killed) < KILLS and not ends.is_set():
            found = [pid for pid in descendants() if pid not in killed and title(pid).startswith("ray::_job")]
            if found:
                os.kill(found[0], signal.SIGKILL)
                killed.append(found[0])
            time.sleep(0.005)

    killer = threading.Thread(target=kill)
    killer.start()
    try:
        touchup.ray.run(jobs, jobs.parent / "killed")
    finally:
        ends.set()
        killer.join()
    assert len(killed) == KILLS
    assert table(jobs, jobs.parent / "killed") == table(jobs, serial)
    # nor does anything of the killed ones remain
    assert files_of(jobs.parent / "killed") == files_of(serial)


def test_the_command_says_how_far_it_is(jobs, serial):
    """As a program of its own, with a cluster of its own."""
    results = jobs.parent / "by_command"
    program = [sys.executable, "-m", "touchup.ray", str(jobs), "--results", str(results)]
    ended = subprocess.run(program, capture_output=True, text=True, timeout=DEADLINE_S, cwd=jobs.parent)
    assert ended.returncode == 0, ended.stderr
    assert "12 of 12 jobs have a result" in ended.stderr
    assert files_of(results) == files_of(serial)


def descendants():
    """Descendants of this process, by the parents in /proc."""
    parents = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            parents[int(path.parent.name)] = int(path.read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
    found, waiting = set(), {os.getpid()}
    while waiting:
        waiting = {pid for pid, parent in parents.items() if parent in waiting} - found
        found |= waiting
    return sorted(found)


def title(pid):
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    except OSError:
        return ""


def test_types_are_right_beside_those_of_ray(tmp_path):
    ended = subprocess.run([sys.executable, "-m", "mypy", "--strict", "-p", "touchup"], capture_output=True, text=True, cwd=tmp_path)
    assert ended.returncode == 0, ended.stdout
