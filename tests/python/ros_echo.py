"""The example ros_echo as a process: a node whose other end tests play."""

import os

import pytest
from conftest import ROOT
from running import Running


def echo_binary():
    """The newest build of cargo; cargo test builds it too."""
    places = [ROOT / "target" / profile / "examples/ros_echo" for profile in ("release", "debug")]
    built = [place for place in places if place.is_file()]
    if os.environ.get("TOUCHUP_ECHO"):
        return os.environ["TOUCHUP_ECHO"]
    if not built:
        pytest.skip("needs cargo build --release --example ros_echo")
    return str(max(built, key=lambda place: place.stat().st_mtime))


class Echo(Running):
    """A running ros_echo."""

    def __init__(self, domain, *arguments, wrapper=()):
        super().__init__([*wrapper, echo_binary(), *arguments], {"ROS_DOMAIN_ID": str(domain)})
        self.wait_for(lambda: "ready" in self.out)

    def has(self, *words):
        """Whether a line has all of them."""
        return any(all(word in line for word in words) for line in [*self.out, *self.err])

    def __exit__(self, *_):
        # it ends with its stdin
        self.process.stdin.close()
        self.wait()
