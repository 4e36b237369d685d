"""A viewer as a process of its own: takes the tiles of the mesh and the diagnostics, writes its state on request.

python ros_viewer.py DOMAIN: answers each line on its standard input with one line of JSON: tiles by id, each with its
number of points and a sum over its bytes; and the last states in the diagnostics.
"""

import json
import sys
import threading
import zlib

from ros_cyclone import LATCHED, RELIABLE, DiagnosticArray, Marker, Peer


def main():
    peer = Peer(int(sys.argv[1]))
    mesh = peer.reader("/mesh", Marker, LATCHED)
    diagnostics = peer.reader("/diagnostics", DiagnosticArray, RELIABLE)
    tiles, states, values = {}, [], {}
    asked = threading.Event()

    def listen():
        for _ in sys.stdin:
            asked.set()

    threading.Thread(target=listen, daemon=True).start()
    print("ready", flush=True)
    while True:
        # a tile takes Python some milliseconds: no more of them at a time, or a question waits for all that have come
        markers = mesh.take(20)
        for marker in markers:
            if marker.action == 3:
                tiles.clear()
            elif marker.action == 2:
                tiles.pop(marker.id, None)
            else:
                points = [(point.x, point.y, point.z) for point in marker.points]
                tiles[marker.id] = [len(points), zlib.crc32(repr(points).encode())]
        for message in diagnostics.take(100):
            for status in message.status:
                values.update((value.key, value.value) for value in status.values)
                if status.name.endswith("session") and (not states or states[-1] != status.message):
                    states.append(status.message)
        if asked.wait(0 if markers else 0.02):
            asked.clear()
            print(json.dumps({"tiles": tiles, "states": states, "values": values}), flush=True)


if __name__ == "__main__":
    main()
