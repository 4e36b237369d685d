"""The actions that our launch files use."""

from launch.substitutions import perform


class Action:
    """An action of a launch file."""

    def __init__(self, *, condition=None):
        self.condition = condition


class DeclareLaunchArgument(Action):
    """Gives an argument its default, and checks it."""

    def __init__(self, name, *, default_value=None, description=None, choices=None, condition=None):
        super().__init__(condition=condition)
        assert isinstance(name, str) and description, f"{name}: an argument without a description"
        if choices is not None and isinstance(default_value, str) and default_value not in choices:
            raise RuntimeError(f'Provided default_value "{default_value}" is not in provided choices "{choices}".')
        self.name, self.default_value, self.description, self.choices = name, default_value, description, choices

    def execute(self, context):
        """Puts the value into the context."""
        values = context.launch_configurations
        if self.name not in values:
            if self.default_value is None:
                raise RuntimeError(f'Required launch argument "{self.name}" was not provided.')
            values[self.name] = perform(self.default_value, context)
        if self.choices is not None and values[self.name] not in self.choices:
            raise RuntimeError(f'Argument "{self.name}" provided value "{values[self.name]}" is not valid.')


class LogInfo(Action):
    """Writes a line; here the context keeps it."""

    def __init__(self, *, msg, condition=None):
        super().__init__(condition=condition)
        self.msg = msg

    def execute(self, context):
        """Keeps the line."""
        context.lines.append(perform(self.msg, context))


class OpaqueFunction(Action):
    """Calls a function with the context; it returns further actions."""

    def __init__(self, *, function, args=None, kwargs=None, condition=None):
        super().__init__(condition=condition)
        self.function, self.args, self.kwargs = function, args or (), kwargs or {}

    def execute(self, context):
        """Calls it."""
        return self.function(context, *self.args, **self.kwargs)


class Shutdown(Action):
    """Ends everything; only ever made here, never executed."""

    def __init__(self, *, reason="reason not given", condition=None):
        super().__init__(condition=condition)
        self.reason = reason


class IncludeLaunchDescription(Action):
    """Another launch file, with arguments."""

    def __init__(self, launch_description_source, *, launch_arguments=None, condition=None):
        super().__init__(condition=condition)
        self.source, self.arguments = launch_description_source, list(launch_arguments or [])

    def execute(self, context):
        """Sets the arguments and returns the contents of the file."""
        for name, value in self.arguments:
            context.launch_configurations[name] = perform(value, context)
        return self.source.get_launch_description().entities
