"""Text with a value only at the launch."""

import functools
import shlex
import subprocess


def perform(value, context):
    """Text of a string, a substitution or a list of both."""
    if isinstance(value, str):
        return value
    if isinstance(value, (list, tuple)):
        return "".join(perform(part, context) for part in value)
    return value.perform(context)


class LaunchConfiguration:
    """The value of an argument."""

    def __init__(self, variable_name, *, default=None):
        self.variable_name, self.default = variable_name, default

    def perform(self, context):
        """An argument; it must have a declaration or a default."""
        if self.variable_name not in context.launch_configurations and self.default is None:
            raise RuntimeError(f"launch configuration '{self.variable_name}' does not exist")
        return context.launch_configurations.get(self.variable_name, self.default)


@functools.cache
def ran(words):
    return subprocess.run(words, capture_output=True, text=True, timeout=60)


class Command:
    """Output of a command."""

    def __init__(self, command, *, on_stderr="fail"):
        assert on_stderr in ("fail", "ignore", "warn", "capture")
        self.command, self.on_stderr = command, on_stderr

    def perform(self, context):
        """Runs it, without a shell: the same words once, as each run of xacro takes a while and reads files that stay."""
        words = tuple(shlex.split(perform(self.command, context)))
        done = ran(words)
        if done.returncode != 0 or self.on_stderr == "fail" and done.stderr:
            raise RuntimeError(f"executed command failed: {words}: {done.stderr}")
        return done.stdout
