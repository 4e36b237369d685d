"""Debian's Slurm (slurm-wlm, munge) on this machine alone: controller and node, in a folder of their own, for the time of a test."""

import os
import pwd
import shutil
import socket
import subprocess
import time

# limit of any wait; nothing should take as long
DEADLINE_S = 120

CONFIGURATION = """\
ClusterName=touchup
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller_port}
SlurmdPort={node_port}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
MaxArraySize=1001
SchedulerParameters=batch_sched_delay=0,sched_interval=1,sched_min_interval=0
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} RealMemory=2000 State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


def free_port():
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        return listening.getsockname()[1]


class Slurm:
    """A cluster of one machine; it ends only its own processes, by their ids."""

    def __init__(self, folder, cpus=2):
        self.folder, self.cpus, self.processes = folder, cpus, []
        self.environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}

    def __enter__(self):
        # the key of munge and its folder belong to its user alone
        self.folder.chmod(0o755)
        for name in ("state", "spool"):
            (self.folder / name).mkdir()
        key = self.folder / "munge.key"
        key.write_bytes(os.urandom(128))
        key.chmod(0o400)
        numbers = {"controller_port": free_port(), "node_port": free_port(), "cpus": self.cpus}
        host, user = socket.gethostname().partition(".")[0], pwd.getpwuid(os.getuid()).pw_name
        (self.folder / "slurm.conf").write_text(CONFIGURATION.format(host=host, user=user, folder=self.folder, **numbers))
        (self.folder / "cgroup.conf").write_text("CgroupPlugin=cgroup/v1\nCgroupMountpoint=/nowhere\n")
        try:
            files = [f"--{name}={self.folder}/munge.{ending}" for name, ending in MUNGE_FILES]
            self.start("munged", "--foreground", "--force", "--num-threads=2", *files)
            self.wait_for(lambda: (self.folder / "munge.socket").exists())
            self.start("slurmctld", "-D")
            self.start("slurmd", "-D")
            self.wait_for(lambda: self.run("sinfo", "--noheader", "--format=%T").stdout.strip() == "idle")
        except BaseException:
            self.__exit__()
            raise
        return self

    def start(self, name, *arguments):
        program = shutil.which(name, path=f"/usr/sbin:{os.environ['PATH']}")
        assert program, f"{name} is not installed (Debian: apt-get install slurm-wlm munge)"
        with open(self.folder / f"{name}.log", "w") as log:
            options = {"env": self.environment, "stdout": log, "stderr": subprocess.STDOUT, "start_new_session": True}
            self.processes.append(subprocess.Popen([program, *arguments], **options))

    def run(self, *command, **options):
        return subprocess.run([str(word) for word in command], env=self.environment, capture_output=True, text=True, **options)

    def wait_for(self, condition):
        until = time.monotonic() + DEADLINE_S
        while not condition():
            ended = [process.args[0] for process in self.processes if process.poll() is not None]
            assert not ended and time.monotonic() < until, f"{ended}: {self.logs()}"
            time.sleep(0.1)

    def logs(self):
        return "\n".join(f"{path.name}:\n{path.read_text()[-2000:]}" for path in sorted(self.folder.glob("*.log")))

    def __exit__(self, *_):
        # node, controller, munge
        for process in reversed(self.processes):
            process.terminate()
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


MUNGE_FILES = [("key-file", "key"), ("socket", "socket"), ("pid-file", "pid"), ("log-file", "log"), ("seed-file", "seed")]
