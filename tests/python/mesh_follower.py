"""A program that follows the mesh by MeshPatch and ResyncMesh alone, as docs/ros.md says: after any losses in transport, it ends with the
mesh of the node. Its messages may be those of any library that has the fields of msg/msg/MeshPatch.msg; test_ros_node.py runs it.
"""


class Follower:
    """Keeps a copy of the mesh: vertices by number (x, y, z, variance, support) and faces by number (three vertices)."""

    def __init__(self, resync):
        self.vertices, self.faces = {}, {}
        self.session, self.version, self.next_part = "", 0, 0
        # the service; whether it waits for the whole state, which one has begun, the time since its last part, and the changes since it
        # began
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
        """A part of the whole state: of any that begins during the wait."""
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
        """A periodic call: asks again if a part of the whole state is missing."""
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
