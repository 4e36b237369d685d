"""touchup as processes on a network: the node, and recordings played to it."""

import itertools
import json
import signal
import time

from ros_cyclone import Peer
from running import Running


class Process(Running):
    """A running touchup."""

    def __init__(self, program, *arguments, domain, wrapper=(), folder=None, environment=()):
        environment = {"ROS_DOMAIN_ID": str(domain), **dict(environment)}
        super().__init__([*wrapper, program, *arguments], environment, folder)

    def end(self, number=signal.SIGINT):
        """Has it end; returns the exit code."""
        self.process.send_signal(number)
        return self.wait()


class Node(Process):
    """`touchup node`, listening."""

    def __init__(self, program, folder, *arguments, domain, ros=(), **options):
        ros = ["-p", f"session_folder:={folder / 'sessions'}", *ros]
        super().__init__(program, "node", "--json", *arguments, "--ros-args", *ros, domain=domain, **options)
        self.wait_for(lambda: any("listens to" in line for line in self.out))
        (self.session,) = (folder / "sessions").iterdir()

    def report(self):
        """Its report at the end."""
        return json.loads(self.out[-1])


class Client:
    """A caller of one service of a node, which has `service_mapping:=cyclone`."""

    def __init__(self, node, domain, name, request, response, peer=None):
        self.node, self.request, self.numbers = node, request, itertools.count(1)
        self.peer = peer or Peer(domain)
        self.writer, self.reader = self.peer.client(f"/touchup/{name}", request, response)

    def introduce(self, *harmless):
        """Repeats a question without effect until its answer: from then on both sides know each other, and no message is lost."""
        answers = []

        def is_answered():
            self.writer.write(self.request(1, next(self.numbers), *harmless))
            time.sleep(0.1)
            answers.extend(self.reader.take(10))
            return answers

        self.node.wait_for(is_answered)
        return answers[0]

    def ask(self, *fields):
        """Asks once; the answer to that."""
        number, answers = next(self.numbers), []
        self.writer.write(self.request(1, number, *fields))

        def is_answered():
            answers.extend(answer for answer in self.reader.take(10) if answer.seq == number)
            return answers

        self.node.wait_for(is_answered, every_s=0.0005)
        return answers[0]


def play(program, recording, *arguments, domain, **options):
    """Runs `touchup replay` to its end; returns its output."""
    with Process(program, "replay", recording, "--json", *arguments, domain=domain, **options) as player:
        assert player.wait() == 0, player.text()
        return json.loads(player.out[-1])
