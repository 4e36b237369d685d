"""Programs that stand still for a while, like a laptop that sleeps or a program in a debugger, and then return."""

import contextlib
import itertools
import os
import signal
import sys
import time
from pathlib import Path

import pytest
from ros_domains import domains
from ros_echo import Echo
from ros_fastdds import FastDds
from ros_process import Process

# time until the other side hears a program again; beside other tests this is no measurement
BACK_S = 5 if os.environ.get("TOUCHUP_FULL") else 60
# CycloneDDS asks others to wait for 10 s, Fast DDS for 20 s, RustDDS for 50 s
LONG = [pytest.param(pause_s, marks=pytest.mark.full) for pause_s in (35, 60, 120)]
LOOPBACK = '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces></General></Domain></CycloneDDS>'
REACHES = {"LOCALHOST": {"CYCLONEDDS_URI": LOOPBACK}, "SUBNET": {}}


class Pair:
    """A sensor that sends wrenches and a node that sends each back, in a domain of their own; `who` of them will stand still."""

    def __init__(self, stack, reach, who):
        domain, variables = next(domains), {"ROS_AUTOMATIC_DISCOVERY_RANGE": reach, **REACHES[reach]}
        wrapper = ["env", *(f"{name}={value}" for name, value in variables.items())]
        sensor = [sys.executable, Path(__file__).with_name("ros_sender.py"), domain]
        self.name, self.echo = f"{reach} {who}", stack.enter_context(Echo(domain, wrapper=wrapper))
        self.sensor = stack.enter_context(Process(*sensor, domain=domain, wrapper=wrapper))
        self.still = [one for name, one in (("sensor", self.sensor), ("node", self.echo)) if who in (name, "both")]

    def goes_on(self, deadline_s=120):
        """Waits until wrenches come back, and not those alone that waited in a socket."""
        count = len(self.sensor.out)
        self.sensor.wait_for(lambda: len(self.sensor.out) > count + 50, deadline_s)


def stand_still(programs, pause_s):
    for program in programs:
        program.process.send_signal(signal.SIGSTOP)
    time.sleep(pause_s)
    for program in programs:
        program.process.send_signal(signal.SIGCONT)


@pytest.mark.parametrize("pause_s", [13, *LONG])
def test_who_stood_still_is_heard_again(pause_s):
    reaches = REACHES if pause_s > 13 else ["LOCALHOST"]
    with contextlib.ExitStack() as stack:
        pairs = [Pair(stack, reach, who) for reach, who in itertools.product(reaches, ("sensor", "node", "both"))]
        for pair in pairs:
            pair.goes_on()
        stand_still([program for pair in pairs for program in pair.still], pause_s)
        until = time.monotonic() + BACK_S
        for pair in pairs:
            pair.goes_on(until - time.monotonic())
        # no participant drops out again at the end of leases
        time.sleep(pause_s - 13)
        for pair in pairs:
            pair.goes_on(BACK_S)
            # the test waits for CycloneDDS until 40 s of silence
            if pause_s > 50 and pair.name.endswith("sensor"):
                assert pair.echo.has("WARN", "out of reach") and pair.echo.has("WARN", "a program there is met again")


@pytest.mark.full
@pytest.mark.parametrize("who", ["caller", "node"])
@pytest.mark.parametrize("pause_s", [25, 60])
def test_who_stood_still_is_answered_again(tmp_path_factory, who, pause_s):
    domain, fast_dds = next(domains), FastDds(tmp_path_factory.mktemp("fastdds"))
    with Echo(domain) as echo, fast_dds.client(echo, domain, "/touchup/undo", "touchup_msgs/srv/Undo") as undo:
        assert undo(strokes=1).message == "echo"
        stand_still([undo if who == "caller" else echo], pause_s)
        time.sleep(BACK_S)
        assert undo(strokes=2).message == "echoecho"
