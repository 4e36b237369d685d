"""DDS domains that no other process has.

Tests that run side by side, in this run or in another on the same machine, would hear each other in one domain.
"""

import fcntl
import itertools
import tempfile
from pathlib import Path

# those whose ports the system gives to no other process (DDS gives each domain 250 from 7400 on; Linux takes those of connections from
# 32768 to 60999); those of users are low
FREE = [*range(60, 102), *range(215, 233)]
# a process takes no more, so that others find some too; a test finds its domain empty, as the one before has left it
MOST = 15


def locked(domain):
    """A lock on it for the life of this process; None if another process has it."""
    try:
        lock = open(Path(tempfile.gettempdir()) / f"touchup-dds-domain-{domain}.lock", "w")
    except OSError:
        return None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        lock.close()
        return None
    return lock


def domains_of_this_process():
    """One after the other, again from the first on."""
    ours = {}
    for domain in FREE:
        lock = locked(domain)
        if lock:
            ours[domain] = lock
            yield domain
        if len(ours) == MOST:
            break
    assert ours, f"other tests on this machine have all DDS domains: {FREE}"
    yield from itertools.cycle(ours)


domains = domains_of_this_process()
