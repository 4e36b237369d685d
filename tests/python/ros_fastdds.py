"""The peer of tests/fastdds/peer.cpp as processes: a ROS 2 node with rmw_fastrtps, by Fast DDS alone.

It uses Debian's Fast DDS, or the one below FASTDDS_ROOT. rosbags writes and reads messages.
"""

import os
import shutil
import subprocess
from pathlib import Path

import make_ros_cdr
import pytest
from conftest import ROOT
from rosbags.typesys import get_types_from_msg
from running import Running

GET_RESULT = {
    "GetResult_Request": "unique_identifier_msgs/msg/UUID goal_id",
    "GetResult_Response": "int8 status\ntouchup_msgs/action/Probe_Result result",
    "SendGoal_Request": "unique_identifier_msgs/msg/UUID goal_id\ntouchup_msgs/action/Probe_Goal goal",
    "SendGoal_Response": "bool accepted\nbuiltin_interfaces/msg/Time stamp",
}


def build(folder):
    """Compiles the peer; its path, and the folder of the libraries that it loads."""
    root = Path(os.environ.get("FASTDDS_ROOT", "/"))
    if not (root / "usr/include/fastdds").is_dir() or not shutil.which("g++"):
        pytest.skip("needs Fast DDS and a C++ compiler: apt-get install libfastrtps-dev g++")
    binary = folder / "peer"
    multiarch = next((root / "usr/lib").glob("*/libfastrtps.so")).parent
    includes = [f"-I{root}/usr/include", f"-I{root}/usr/include/{multiarch.name}"]
    link = [f"-L{multiarch}", "-lfastrtps", "-lfastcdr", f"-Wl,-rpath-link,{multiarch}"]
    subprocess.run(
        ["g++", "-std=c++17", "-O1", *includes, ROOT / "tests/fastdds/peer.cpp", "-o", binary, *link], check=True, timeout=600
    )
    return binary, multiarch


class FastDds:
    """The peer, built; starts processes of it."""

    def __init__(self, folder):
        self.binary, self.libraries = build(folder)
        self.store = make_ros_cdr.types()
        known = {}
        for name, text in GET_RESULT.items():
            known.update(get_types_from_msg(text, f"touchup_msgs/action/Probe_{name}"))
        self.store.register(known)

    def start(self, *arguments, wrapper=()):
        return Peer(self, [*wrapper, self.binary, *map(str, arguments)])

    def client(self, echo, domain, service, type_name, wrapper=()):
        """A caller of a service, met by the node."""
        package, kind, short = type_name.split("/")
        prefix = f"{package}::{kind}::dds_::{short}"
        made = Client(self, [*wrapper, self.binary, "call", str(domain), service, prefix])
        made.type_name = type_name
        made.wait_for(lambda: "matched" in made.out)
        for what in ("a caller is heard", "a caller can be answered"):
            echo.wait_for(lambda what=what: echo.has(what, f'"{service}"'))
        return made

    def listener(self, echo, domain, topic, type_name, wrapper=()):
        """A listener on a topic, met by the node."""
        package, kind, short = type_name.split("/")
        made = Listener(
            self, [*wrapper, self.binary, "listen", str(domain), f"rt{topic}", f"{package}::{kind}::dds_::{short}_"]
        )
        made.type_name = type_name
        made.wait_for(lambda: "matched" in made.out)
        echo.wait_for(lambda: echo.has("Matched", f'"{topic}"', "count: 1"))
        return made

    def read(self, digits, type_name):
        return self.store.deserialize_cdr(bytes.fromhex(digits), make_ros_cdr.known(type_name))


class Peer(Running):
    """A process of it."""

    may_end_with = (0,)

    def __init__(self, fast_dds, command):
        self.fast_dds = fast_dds
        super().__init__(command, {"LD_LIBRARY_PATH": str(fast_dds.libraries)})

    def finish(self):
        """Waits for its end; returns its output."""
        assert self.wait() == 0, self.text()
        return self.text()

    def text(self):
        return "\n".join(line[:200] for line in super().text().splitlines())

    def __exit__(self, *_):
        # it ends with its stdin
        self.process.stdin.close()
        self.wait()


class Client(Peer):
    """Calls a service, each time once."""

    def __call__(self, **fields):
        name, store = make_ros_cdr.known(f"{self.type_name}_Request"), self.fast_dds.store
        before = len(self.out)
        self.write(bytes(store.serialize_cdr(store.types[name](**fields), name)).hex())
        self.wait_for(lambda: len(self.out) > before)
        word, digits = self.out[before].split(" ", 1)
        assert word == "answer", self.text()
        # one packet of Ethernet has no more
        self.bytes = len(digits) // 2
        assert self.bytes <= 1308
        return self.fast_dds.read(digits, f"{self.type_name}_Response")


class Listener(Peer):
    """Takes messages."""

    taken = 0

    def next(self):
        has_come = lambda: [line for line in self.out if line.startswith("message ")][self.taken :]  # noqa: E731
        self.wait_for(has_come)
        line = has_come()[0]
        self.taken += 1
        return self.fast_dds.read(line.split(" ", 1)[1], self.type_name)
