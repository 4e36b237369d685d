"""The example ros_echo as a process: a node whose other end tests play."""

import itertools
import os
import subprocess
import threading
import time

import pytest
from conftest import ROOT

# nothing is waited for longer; nothing is expected to take as long
DEADLINE_S = 60
# a domain of its own for each test, whose ports the system hands to nobody else (DDS gives each domain 250 from 7400 on; Linux
# takes those of connections from 32768 to 60999); those of users are low
FREE = [*range(60, 102), *range(215, 233)]
domains = (FREE[(os.getpid() + number) % len(FREE)] for number in itertools.count())


def echo_binary():
    """What cargo has built last; cargo test builds it too."""
    places = [ROOT / "target" / profile / "examples/ros_echo" for profile in ("release", "debug")]
    built = [place for place in places if place.is_file()]
    if os.environ.get("TOUCHUP_ECHO"):
        return os.environ["TOUCHUP_ECHO"]
    if not built:
        pytest.skip("needs cargo build --release --example ros_echo")
    return str(max(built, key=lambda place: place.stat().st_mtime))


class Echo:
    """A running ros_echo and the lines that it writes."""

    def __init__(self, domain, *arguments, wrapper=()):
        command = [*wrapper, echo_binary(), *arguments]
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(
            command, env=environment, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT, text=True
        )
        self.lines = []
        threading.Thread(target=self.read, daemon=True).start()
        self.wait_for(lambda: "ready" in self.lines)

    def read(self):
        for line in self.process.stdout:
            self.lines.append(line.rstrip())

    def wait_for(self, condition):
        until = time.monotonic() + DEADLINE_S
        while not condition():
            assert time.monotonic() < until, "\n".join(self.lines)
            time.sleep(0.01)

    def has(self, *words):
        return any(all(word in line for word in words) for line in self.lines)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.stdin.close()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise
