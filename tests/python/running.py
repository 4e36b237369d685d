"""Programs beside a test, and their output."""

import os
import subprocess
import threading
import time

# limit of any wait; nothing should take as long
DEADLINE_S = 120


class Running:
    """A running program, the lines that it writes, and those on its stderr."""

    # permitted exit codes during the wait
    may_end_with = ()

    def __init__(self, command, environment=(), folder=None):
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(
            [str(word) for word in command],
            env={**os.environ, **dict(environment)},
            cwd=folder,
            stdin=pipe,
            stdout=pipe,
            stderr=pipe,
            text=True,
        )
        self.out, self.err = [], []
        self.readers = [
            threading.Thread(target=self.read_lines, args=(stream, lines), daemon=True)
            for stream, lines in [(self.process.stdout, self.out), (self.process.stderr, self.err)]
        ]
        for reader in self.readers:
            reader.start()

    @staticmethod
    def read_lines(stream, lines):
        for line in stream:
            lines.append(line.rstrip())

    def write(self, line=""):
        """Writes a line to it."""
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def wait_for(self, condition, deadline_s=DEADLINE_S, every_s=0.01):
        """Waits until it holds."""
        until = time.monotonic() + deadline_s
        while not condition():
            assert self.process.poll() in (None, *self.may_end_with) and time.monotonic() < until, self.text()
            time.sleep(every_s)

    def wait(self, deadline_s=DEADLINE_S):
        """Waits for its end; returns the exit code."""
        code = self.process.wait(deadline_s)
        for reader in self.readers:
            reader.join()
        return code

    def text(self):
        return "\n".join([*self.out, *self.err])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.wait()
