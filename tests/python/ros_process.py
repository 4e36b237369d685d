"""touchup as processes on a network: the node, and recordings that are played to it."""

import json
import os
import signal
import subprocess
import threading
import time

from ros_echo import DEADLINE_S


class Process:
    """A running touchup and the lines that it writes."""

    def __init__(self, program, *arguments, domain, wrapper=(), folder=None):
        command = [*wrapper, str(program), *map(str, arguments)]
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(command, env=environment, cwd=folder, stdin=pipe, stdout=pipe, stderr=pipe, text=True)
        self.out, self.told = [], []
        self.readers = [
            threading.Thread(target=self.read, args=(stream, lines), daemon=True)
            for stream, lines in [(self.process.stdout, self.out), (self.process.stderr, self.told)]
        ]
        for reader in self.readers:
            reader.start()

    @staticmethod
    def read(stream, lines):
        for line in stream:
            lines.append(line.rstrip())

    def wait_for(self, condition, deadline_s=DEADLINE_S):
        """Waits until it holds."""
        until = time.monotonic() + deadline_s
        while not condition():
            assert self.process.poll() is None and time.monotonic() < until, self.text()
            time.sleep(0.01)

    def wait(self, deadline_s=120):
        """Waits for its end; returns the exit code."""
        code = self.process.wait(deadline_s)
        for reader in self.readers:
            reader.join()
        return code

    def end(self, number=signal.SIGINT):
        """Has it end; returns the exit code."""
        self.process.send_signal(number)
        return self.wait()

    def text(self):
        return "\n".join([*self.out, *self.told])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.wait()


class Node(Process):
    """`touchup node`, listening."""

    def __init__(self, program, folder, *arguments, domain, ros=(), **options):
        ros = ["-p", f"session_folder:={folder / 'sessions'}", *ros]
        super().__init__(program, "node", "--json", *arguments, "--ros-args", *ros, domain=domain, **options)
        self.wait_for(lambda: any("listens to" in line for line in self.out), 60)
        (self.session,) = (folder / "sessions").iterdir()

    def report(self):
        """What it said at its end."""
        return json.loads(self.out[-1])


def play(program, recording, *arguments, domain, **options):
    """`touchup replay` to its end; what it says."""
    with Process(program, "replay", recording, "--json", *arguments, domain=domain, **options) as player:
        assert player.wait() == 0, player.text()
        return json.loads(player.out[-1])
