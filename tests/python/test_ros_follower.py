"""A program that follows the mesh by MeshPatch and ResyncMesh alone, as in docs/ros.md: it ends with the node's mesh, whatever
was lost in transport. The messages are those of msg/, read by rosbags; the node is a model of one, with random changes.
"""

import random

import numpy
import pytest
from conftest import ROOT
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

store = get_typestore(Stores.ROS2_HUMBLE)
store.register(get_types_from_msg((ROOT / "msg/msg/MeshPatch.msg").read_text(), "touchup_msgs/msg/MeshPatch"))
MeshPatch = store.types["touchup_msgs/msg/MeshPatch"]


class Follower:
    """Keeps a copy of the mesh: vertices by number (x, y, z, variance, support) and faces by number (three vertices)."""

    def __init__(self, resync):
        self.vertices, self.faces = {}, {}
        self.session, self.version, self.next_part = "", 0, 0
        # the service; whether the whole state is waited for, which one has begun, for how long nothing of it came, and the
        # changes since it began
        self.resync, self.is_waiting, self.begun, self.waited, self.kept = resync, False, None, 0, []

    def take(self, patch):
        """Takes a message up, keeps it, passes over it, or asks for the whole state."""
        if self.is_waiting and patch.base_version == 0:
            self.take_whole(patch)
        elif self.is_waiting:
            self.kept += [patch] if self.begun else []
        elif patch.session == self.session and patch.version <= self.version:
            pass
        elif (patch.session, patch.base_version, patch.part) == (self.session, self.version, self.next_part):
            self.apply(patch)
        else:
            self.ask()

    def take_whole(self, patch):
        """A part of the whole state: of any that begins while it is waited for."""
        if patch.part == 0:
            self.vertices, self.faces = {}, {}
            # earlier changes are in it
            self.begun, self.next_part, self.kept = (patch.session, patch.version), 0, []
        if (patch.session, patch.version, patch.part) != (*(self.begun or ("", 0)), self.next_part):
            return
        self.waited = 0
        self.apply(patch)
        if self.next_part == 0:
            self.is_waiting, kept, self.kept = False, self.kept, []
            for later in kept:
                self.take(later)

    def ask(self):
        """Has the whole state sent; nothing that was begun goes on."""
        self.is_waiting, self.begun, self.waited = True, None, 0
        self.resync()

    def tick(self):
        """Called from time to time: asks again where a part of the whole state was lost."""
        self.waited += 1
        if self.is_waiting and self.waited > 10:
            self.ask()

    def apply(self, patch):
        """One part, in the order that MeshPatch names."""
        for face in patch.removed_faces:
            del self.faces[int(face)]
        for at, vertex in enumerate(patch.vertices):
            place = tuple(map(float, patch.positions[3 * at : 3 * at + 3]))
            self.vertices[int(vertex)] = (*place, float(patch.variance[at]), int(patch.support[at]))
        for at, face in enumerate(patch.faces):
            self.faces[int(face)] = tuple(map(int, patch.corners[3 * at : 3 * at + 3]))
        for vertex in patch.removed_vertices:
            del self.vertices[int(vertex)]
        self.next_part = patch.part + 1
        if self.next_part == patch.part_count:
            self.session, self.version, self.next_part = patch.session, patch.version, 0
            assert (len(self.vertices), len(self.faces)) == (patch.vertex_count, patch.face_count)


class Node:
    """Changes a mesh at random and publishes it; `send` gets each message as bytes."""

    def __init__(self, seed, send):
        self.random, self.send = random.Random(seed), send
        self.session, self.version, self.vertices, self.faces = "a", 0, {}, {}
        # of the whole state that is being sent, and whether another one is to follow
        self.due, self.is_asked = [], False
        self.change()

    def change(self):
        """Some faces go, some vertices move, some of both come: numbers that are free are given again."""
        pick = self.random
        removed = pick.sample(sorted(self.faces), len(self.faces) // 5)
        for face in removed:
            del self.faces[face]
        free = (number for number in range(10_000) if number not in self.vertices)
        touched = pick.sample(sorted(self.vertices), len(self.vertices) // 4) + [next(free) for _ in range(pick.randint(3, 9))]
        for vertex in dict.fromkeys(touched):
            place = [float(numpy.float32(pick.gauss(0, 0.1))) for _ in range(4)]
            self.vertices[vertex] = (*place, pick.randint(0, 3))
        free = (number for number in range(10_000) if number not in self.faces)
        added = [next(free) for _ in range(pick.randint(3, 9))]
        for face in added:
            self.faces[face] = tuple(pick.sample(sorted(self.vertices), 3))
        used = {corner for corners in self.faces.values() for corner in corners}
        gone = sorted(set(self.vertices) - used)
        base, self.version = self.version, self.version + 1
        parts = self.parts(base, removed, sorted(set(touched)), added, gone)
        for vertex in gone:
            del self.vertices[vertex]
        if base > 0:
            self.publish(parts)

    def resync(self):
        """The service: a request while one is being sent gets the next, which has not begun."""
        self.is_asked = True

    def parts(self, base, removed, vertices, faces, gone):
        """A change as messages of at most 8 vertices or faces; the counts are those afterwards."""
        runs = [("removed_faces", removed), ("vertices", vertices), ("faces", faces), ("removed_vertices", gone)]
        cuts = [(name, run[at : at + 8]) for name, run in runs for at in range(0, len(run), 8)] or [("faces", [])]
        counts = len(set(self.vertices) - set(gone)), len(self.faces)
        return [self.message(base, part, len(cuts), {name: run}, counts) for part, (name, run) in enumerate(cuts)]

    def message(self, base, part, part_count, given, counts):
        """One part, as bytes."""
        header = store.types["std_msgs/msg/Header"](store.types["builtin_interfaces/msg/Time"](0, 0), "object")
        vertices, faces = given.get("vertices", []), given.get("faces", [])
        places = [self.vertices[vertex] for vertex in vertices]
        patch = MeshPatch(
            header=header,
            session=self.session,
            version=self.version,
            base_version=base,
            part=part,
            part_count=part_count,
            removed_faces=numpy.array(given.get("removed_faces", []), numpy.uint32),
            vertices=numpy.array(vertices, numpy.uint32),
            positions=numpy.array([x for place in places for x in place[:3]], numpy.float32),
            variance=numpy.array([place[3] for place in places], numpy.float32),
            support=numpy.array([place[4] for place in places], numpy.uint8),
            faces=numpy.array(faces, numpy.uint32),
            corners=numpy.array([corner for face in faces for corner in self.faces[face]], numpy.uint32),
            removed_vertices=numpy.array(given.get("removed_vertices", []), numpy.uint32),
            vertex_count=counts[0],
            face_count=counts[1],
        )
        return store.serialize_cdr(patch, "touchup_msgs/msg/MeshPatch")

    def publish(self, parts):
        """Sends a change, then a part of the whole state where requested."""
        for part in parts:
            self.send(part)
        if self.is_asked and not self.due:
            self.due, self.is_asked = self.parts(0, [], sorted(self.vertices), sorted(self.faces), []), False
        for _ in range(min(len(self.due), self.random.randint(0, 20))):
            self.send(self.due.pop(0))


@pytest.mark.parametrize("seed", range(20))
def test_a_follower_ends_with_the_mesh_of_the_node(seed):
    chance, lossy, line = random.Random(1000 + seed), True, []
    # a session of its own from the start: a late subscriber misses the beginning
    node = Node(seed, lambda message: line.append(message) if not lossy or chance.random() > 0.05 else None)
    for _ in range(chance.randint(0, 5)):
        node.change()
    line.clear()
    asked = []
    follower = Follower(lambda: asked.append(node.version) or node.resync())

    def deliver(messages):
        for message in messages:
            follower.take(store.deserialize_cdr(bytes(message), "touchup_msgs/msg/MeshPatch"))
        follower.tick()

    for round_ in range(60):
        if round_ == 30:
            # a reset: another mesh of another name, at a version that the follower has passed
            node.session, node.version = "b", 1
        node.change()
        sent, line = line[:], []
        deliver(sent)
    lossy = False
    for _ in range(200):
        node.change()
        sent, line = line[:], []
        deliver(sent)
        if not follower.is_waiting:
            break
    assert (follower.session, follower.version) == ("b", node.version)
    assert follower.vertices == node.vertices and follower.faces == node.faces
    # losses were noticed, and received messages were not requested again
    assert 1 < len(asked) < 60
