"""The one action of launch_ros that our launch files use."""

import re

import yaml
from launch.actions import Action
from launch.substitutions import perform
from launch_ros.parameter_descriptions import ParameterValue


class Node(Action):
    """Starts a node. Here the context keeps it, with its command line as launch_ros makes it."""

    def __init__(
        self,
        *,
        executable,
        package=None,
        name=None,
        namespace=None,
        exec_name=None,
        parameters=None,
        remappings=None,
        ros_arguments=None,
        arguments=None,
        # of ExecuteProcess and ExecuteLocal
        cwd=None,
        env=None,
        additional_env=None,
        prefix=None,
        shell=False,
        sigterm_timeout="5",
        sigkill_timeout="5",
        emulate_tty=False,
        output="log",
        output_format="",
        cached_output=False,
        log_cmd=False,
        on_exit=None,
        respawn=False,
        respawn_delay=None,
        condition=None,
    ):
        super().__init__(condition=condition)
        assert parameters is None or isinstance(parameters, list), "parameters must be a list"
        assert remappings is None or all(len(pair) == 2 for pair in remappings), "remappings must be pairs"
        assert output in ("log", "screen", "both", "own_log", "full")
        assert float(sigterm_timeout) > 0 and float(sigkill_timeout) > 0
        self.package, self.executable, self.name, self.namespace = package, executable, name, namespace
        self.arguments, self.remappings = list(arguments or []), list(remappings or [])
        self.ros_arguments, self.given_parameters = list(ros_arguments or []), parameters or []
        self.on_exit, self.sigterm_timeout = on_exit, float(sigterm_timeout)
        self.files, self.parameters = [], {}

    def execute(self, context):
        """Evaluates everything that launch_ros would, and keeps the node."""
        if self.name is not None:
            self.name = perform(self.name, context)
            assert re.fullmatch(r"[A-Za-z_]\w*", self.name), f"{self.name} is no name for a node"
        if self.namespace is not None:
            self.namespace = perform(self.namespace, context)
            assert re.fullmatch(r"/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*", self.namespace), f"bad namespace {self.namespace!r}"
        self.arguments = [perform(argument, context) for argument in self.arguments]
        for given in self.given_parameters:
            if isinstance(given, dict):
                self.parameters.update({key: self.value(value, context) for key, value in given.items()})
            else:
                self.files.append(perform(given, context))
        context.nodes.append(self)

    @staticmethod
    def value(value, context):
        """A parameter as launch_ros evaluates it: it reads text as YAML, so that "1" is a number."""
        if isinstance(value, ParameterValue):
            return value.evaluate(context)
        return value if isinstance(value, (bool, int, float)) else yaml.safe_load(perform(value, context))

    def command_line(self):
        """The words after the executable."""
        words = [*self.arguments, *(["--ros-args", *self.ros_arguments] if self.ros_arguments else []), "--ros-args"]
        if self.name is not None:
            words += ["-r", f"__node:={self.name}"]
        if self.namespace is not None:
            words += ["-r", f"__ns:=/{self.namespace.lstrip('/')}"]
        for file in self.files:
            words += ["--params-file", file]
        for source, target in self.remappings:
            words += ["-r", f"{source}:={target}"]
        return words
