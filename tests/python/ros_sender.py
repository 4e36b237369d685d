"""A sensor as a process of its own, which a test can stop: sends wrenches, and prints those that came back as mismatches.

python ros_sender.py DOMAIN
"""

import sys
import time

from ros_cyclone import BEST_EFFORT, HapticMismatch, Header, Peer, Time, Vector3, Wrench, WrenchStamped


def main():
    peer = Peer(int(sys.argv[1]))
    wrenches = peer.writer("/stylus/wrench", WrenchStamped, BEST_EFFORT)
    mismatches = peer.reader("/mismatch", HapticMismatch, BEST_EFFORT)
    number = 0
    while True:
        number += 1
        wrenches.write(WrenchStamped(Header(Time(number, 0), "sensor"), Wrench(Vector3(0, 0, 0), Vector3(0, 0, 0))))
        time.sleep(0.02)
        for mismatch in mismatches.take(100):
            print("back", mismatch.header.stamp.sec, flush=True)


if __name__ == "__main__":
    main()
