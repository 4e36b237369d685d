"""The command ``touchup``."""

import signal
import sys

from ._touchup import run_command


def main() -> int:
    """Runs the command line of this process and returns its exit code."""
    # Python would note Ctrl-C and go on until the work is done
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return run_command(["touchup", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
