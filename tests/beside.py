#!/usr/bin/env python3
"""Runs a command on a busy machine: its tests have to give the same count.

    tests/beside.py [--busy N] [--stops] COMMAND...

--busy N: beside N endless loops of ordinary priority. --stops: all processes of the command stop for 200 ms every few seconds (SIGSTOP,
SIGCONT), as on a machine whose host has something else to do. Ends with the exit code of the command.
"""

import argparse
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

STOPPED_S = 0.2
# between two stops, s
GOING_S = (1, 8)


def processes_of(session):
    """Running processes of a session, without those that a test has stopped."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            # state and session come after the name, which may have spaces
            state, _, _, its_session = path.read_text().rpartition(")")[2].split()[:4]
        except OSError:
            continue
        if int(its_session) == session and state not in "TtZ":
            found.append(int(path.parent.name))
    return found


def signal_all(processes, number):
    for process in processes:
        try:
            os.kill(process, number)
        except ProcessLookupError:
            pass


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("--busy", type=int, default=0)
    parser.add_argument("--stops", action="store_true")
    parser.add_argument("command", nargs=argparse.REMAINDER)
    arguments = parser.parse_args()
    if not arguments.command:
        parser.error("no command")
    process = subprocess.Popen(arguments.command, start_new_session=True)
    loops = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(arguments.busy)]
    rng, stops = random.Random(1), 0
    try:
        while process.poll() is None:
            try:
                process.wait(rng.uniform(*GOING_S))
            except subprocess.TimeoutExpired:
                if arguments.stops:
                    stopped = processes_of(process.pid)
                    signal_all(stopped, signal.SIGSTOP)
                    time.sleep(STOPPED_S)
                    signal_all(stopped, signal.SIGCONT)
                    stops += 1
    finally:
        # processes of the command that remain after an interruption
        signal_all(processes_of(process.pid), signal.SIGTERM)
        for loop in loops:
            loop.kill()
    print(f"beside {arguments.busy} busy loops, stopped {stops} times: exit code {process.returncode}", file=sys.stderr)
    sys.exit(process.returncode)


if __name__ == "__main__":
    main()
