"""The operator's page from outside: a node that serves one, and a socket as a browser opens it."""

import contextlib
import itertools
import json
import re
import struct
import time

from conftest import ROOT
from ros_domains import domains
from ros_process import Node, Process
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from running import DEADLINE_S
from websockets.sync.client import connect

store = get_typestore(Stores.ROS2_HUMBLE)
store.register(get_types_from_msg((ROOT / "msg/msg/MeshPatch.msg").read_text(), "touchup_msgs/msg/MeshPatch"))

PROTOCOL = "touchup.v1"
# kind 1, a message of DDS in little endian behind its encapsulation
MESH_PATCH = bytes([1, 0, 0, 0])
DEVIATION, OUTLIER = 1, 3


class PageNode(Node):
    """`touchup node --web` on a free port, and the address that it printed."""

    def __init__(self, program, folder, scan, *arguments, address="127.0.0.1:0", ros=(), domain=None, **options):
        self.domain = domain or next(domains)
        ros = ["-p", f"scan:={scan}", "-p", "tip_radius_mm:=1.5", *ros]
        web = ["--web", address, *arguments]
        super().__init__(program, folder, *web, domain=self.domain, ros=ros, **options)
        self.url = page_url(self)


class PageDemo(Process):
    """`touchup demo --web` on a free port, waiting for a page."""

    def __init__(self, program, folder):
        super().__init__(program, "demo", "--web", "127.0.0.1:0", "--out", folder, domain=next(domains))
        self.url = page_url(self)
        self.wait_for(lambda: any("begins when the page is open" in line for line in self.err))


def page_url(process):
    """Address of the page that a program serves."""

    def urls():
        return [found[1] for line in process.err if (found := re.search(r"page: (https?://\S+)", line))]

    process.wait_for(urls)
    return urls()[0]


class Socket:
    """A page's socket: the mesh as a follower has it, the newest of each topic, and answers."""

    def __init__(self, url, origin=None, cookie=None, path="/ws", **options):
        headers = {"Cookie": cookie} if cookie else {}
        address = re.sub("^http", "ws", url) + path
        options = {"origin": origin or url, "subprotocols": [PROTOCOL], "max_size": None, "ping_interval": None, **options}
        self.opened = contextlib.ExitStack()
        self.socket = self.opened.enter_context(connect(address, additional_headers=headers, compression=None, **options))
        self.numbers = itertools.count(1)
        self.newest, self.counts, self.answers = {}, {}, {}
        # by kind: DEVIATION, OUTLIER; then by vertex
        self.numbers_of = {}
        self.session, self.version, self.vertices, self.faces, self.support, self.variance = "", 0, {}, {}, {}, {}
        # session and version, and its triangles then
        self.known_triangles = None

    def take(self, timeout=DEADLINE_S):
        """Takes the next message up."""
        message = self.socket.recv(timeout)
        if isinstance(message, bytes):
            if message[:4] == MESH_PATCH:
                self.take_patch(store.deserialize_cdr(message[4:], "touchup_msgs/msg/MeshPatch"))
            else:
                self.take_numbers(message)
            return
        message = json.loads(message)
        if topic := message.get("topic"):
            self.newest[topic] = message["message"]
            self.counts[topic] = self.counts.get(topic, 0) + 1
        else:
            self.answers[message["id"]] = message

    def take_numbers(self, message):
        """A number for each of some vertices, little endian: 2, which, two zeros, their count, vertices (u32), numbers (f32)."""
        assert message[0] == 2 and message[2:4] == bytes(2)
        (count,) = struct.unpack_from("<I", message, 4)
        assert len(message) == 8 + 8 * count
        vertices = struct.unpack_from(f"<{count}I", message, 8)
        numbers = struct.unpack_from(f"<{count}f", message, 8 + 4 * count)
        self.numbers_of.setdefault(message[1], {}).update(zip(vertices, numbers, strict=True))

    def take_patch(self, patch):
        if patch.base_version == 0 and patch.part == 0:
            self.session, self.vertices, self.faces, self.support, self.variance = patch.session, {}, {}, {}, {}
        assert patch.session == self.session
        for face in patch.removed_faces.tolist():
            self.faces.pop(face, None)
        self.vertices.update(zip(patch.vertices.tolist(), patch.positions.reshape(-1, 3).tolist(), strict=True))
        self.support.update(zip(patch.vertices.tolist(), patch.support.tolist(), strict=True))
        self.variance.update(zip(patch.vertices.tolist(), patch.variance.tolist(), strict=True))
        self.faces.update(zip(patch.faces.tolist(), patch.corners.reshape(-1, 3).tolist(), strict=True))
        for vertex in patch.removed_vertices.tolist():
            self.vertices.pop(vertex, None)
        if patch.part + 1 == patch.part_count:
            self.version = patch.version
            assert (len(self.vertices), len(self.faces)) == (patch.vertex_count, patch.face_count)

    def take_until(self, condition, deadline_s=DEADLINE_S):
        """Takes messages up until it holds."""
        until = time.monotonic() + deadline_s
        while not condition():
            assert time.monotonic() < until, (self.counts, self.answers)
            self.take()

    def call(self, service, /, **request):
        """Calls a service; its answer, whole."""
        number = next(self.numbers)
        self.socket.send(json.dumps({"id": number, "call": service, "request": request}))
        self.take_until(lambda: number in self.answers)
        return self.answers.pop(number)

    def beat(self):
        self.socket.send(json.dumps({"beat": next(self.numbers)}))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.opened.close()
