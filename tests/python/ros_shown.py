"""The visualisation topics of a node during the replay of a recording, received by CycloneDDS."""

import re
import time
from dataclasses import dataclass
from pathlib import Path

from ros_cyclone import LATCHED, RELIABLE, Marker, MarkerArray, Peer
from ros_process import Node, play

# Python takes some 10 ms for each tile
VIEW_RATE_HZ = 0.2
# the mesh is complete when nothing of it has come for longer than between two pictures
QUIET_S = 8


@dataclass
class Shown:
    """The last of everything, and the folder of the session."""

    tiles: list
    features: MarkerArray
    tip: MarkerArray
    session: Path

    def labels(self):
        """Markers with text among the features."""
        return labels(self.features)

    def sizes(self):
        """Text of the labels: (kind, its sizes as (value, half of the interval that holds 95 %)), in mm."""
        number = r"(\d+\.\d\d) ± (\d+\.\d\d)"
        markers = []
        for marker in self.labels():
            read = re.fullmatch(rf"(\w+) Ø?{number}(?: × {number})?", marker.text)
            assert read, marker.text
            given = [float(text) for text in read.groups()[1:] if text]
            markers.append((read[1], list(zip(given[::2], given[1::2], strict=True))))
        return markers


def labels(array):
    """Markers with text."""
    return [marker for marker in array.markers if marker.text]


def show(touchup_bin, demo, out, domain, label_count):
    """Plays demo/touch.mcap to a node with demo/scan.ply and sessions in out, and waits for the expected number of labelled features."""
    ros = ["-p", f"scan:={demo / 'scan.ply'}", "-p", "tip_radius_mm:=1.5", "-p", f"view_rate_hz:={VIEW_RATE_HZ}"]
    with Node(touchup_bin, out, domain=domain, ros=ros) as node:
        peer = Peer(domain)
        mesh = peer.reader("/mesh", Marker, LATCHED)
        features = peer.reader("/feature_markers", MarkerArray, LATCHED)
        tip = peer.reader("/tip", MarkerArray, RELIABLE)
        play(touchup_bin, demo / "touch.mcap", domain=domain)
        arrays, tiles, last = [], {}, time.monotonic()

        def all_there():
            nonlocal last
            arrays.extend(features.take(100))
            came = mesh.take(100)
            tiles.update((tile.id, tile) for tile in came)
            last = time.monotonic() if came else last
            return arrays and len(labels(arrays[-1])) >= label_count and time.monotonic() - last > QUIET_S

        node.wait_for(all_there, 120)
        tips = tip.take(100_000)
        # 4: losses of samples do not matter here
        assert node.end() in (0, 4), node.text()
    return Shown([tiles[number] for number in sorted(tiles)], arrays[-1], tips[-1], node.session)
