"""Computers of their own, as network namespaces, and the network between them: a hub that loses packets and breaks down.

Each computer has one interface, a TAP device whose other end is a thread here. Packets of one go to all others, as on a hub: addresses and
multicast need nothing else. Needs root (or user namespaces), iproute2 and /dev/net/tun.
"""

import ctypes
import fcntl
import os
import random
import select
import struct
import subprocess
import threading

import pytest

CLONE_NEWNET = 0x40000000
TUNSETIFF, IFF_TAP, IFF_NO_PI = 0x400454CA, 0x0002, 0x1000
ETHERNET, IP = 1500, b"\x08\x00"
libc = ctypes.CDLL(None, use_errno=True)


def needed():
    """Skips on a system without such networks."""
    if not os.path.exists("/dev/net/tun") or os.geteuid() != 0:
        pytest.skip("needs root and /dev/net/tun, for networks of its own")


def ip(*arguments):
    subprocess.run(["ip", *arguments], check=True, capture_output=True, text=True)


def enter(path):
    """Has this thread be in the network of a file."""
    with open(path) as network:
        if libc.setns(network.fileno(), CLONE_NEWNET) != 0:
            raise OSError(ctypes.get_errno(), "setns")


class Hub:
    """A network of computers with these names; `wrapper(name)` runs a command on one."""

    def __init__(self, names, loss, seed=1, packet=ETHERNET):
        needed()
        self.packet = packet
        self.loss, self.random, self.is_down, self.is_over = loss, random.Random(seed), False, False
        self.names = {name: f"touchup-{name}-{os.getpid()}" for name in names}
        self.passed = self.dropped = 0
        # by sender, the packets that are part of a larger one
        self.parted = dict.fromkeys(names, 0)
        self.taps = []
        for number, namespace in enumerate(self.names.values()):
            ip("netns", "add", namespace)
            self.taps.append(self.tap(namespace))
            ip("-n", namespace, "address", "add", f"10.77.0.{number + 1}/24", "dev", "cell")
            for device in ("lo", "cell"):
                ip("-n", namespace, "link", "set", device, "up")
            ip("-n", namespace, "route", "add", "239.255.0.0/16", "dev", "cell")
        self.thread = threading.Thread(target=self.forward, daemon=True)
        self.thread.start()

    def tap(self, namespace):
        """A new interface `cell` there, as a file that is open here."""
        made = []

        def make():
            enter(f"/run/netns/{namespace}")
            tap = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
            fcntl.ioctl(tap, TUNSETIFF, struct.pack("16sH22x", b"cell", IFF_TAP | IFF_NO_PI))
            made.append(tap)

        # a thread of its own: this one stays in its network
        thread = threading.Thread(target=make)
        thread.start()
        thread.join()
        assert made, f"no interface in {namespace}"
        ip("-n", namespace, "link", "set", "cell", "mtu", str(self.packet))
        return made[0]

    def forward(self):
        while not self.is_over:
            ready, _, _ = select.select(self.taps, [], [], 0.1)
            for tap in ready:
                self.empty(tap)

    def empty(self, tap):
        """Passes on the packets of one computer."""
        while True:
            try:
                frame = os.read(tap, 2048)
            except BlockingIOError:
                return
            assert len(frame) <= self.packet + 14
            # more of it comes, or it begins somewhere in the larger one
            if frame[12:14] == IP and struct.unpack("!H", frame[20:22])[0] & 0x3FFF:
                self.parted[list(self.names)[self.taps.index(tap)]] += 1
            for other in self.taps:
                if other == tap:
                    continue
                if self.is_down or self.random.random() < self.loss:
                    self.dropped += 1
                    continue
                self.passed += 1
                try:
                    os.write(other, frame)
                except (BlockingIOError, OSError):
                    self.dropped += 1

    def wrapper(self, name):
        """Prefix of a command that runs there."""
        return ["ip", "netns", "exec", self.names[name]]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.is_over = True
        self.thread.join()
        for tap in self.taps:
            os.close(tap)
        for namespace in self.names.values():
            ip("netns", "delete", namespace)
