"""Parameters with a type."""

import yaml
from launch.substitutions import perform


class ParameterValue:
    """A value, or a substitution that reads as YAML unless `value_type` gives the type."""

    def __init__(self, value, *, value_type=None):
        self.value, self.value_type = value, value_type

    def evaluate(self, context):
        """The value with its type."""
        text = perform(self.value, context)
        value = text if self.value_type is str else yaml.safe_load(text)
        if self.value_type is not None and not isinstance(value, self.value_type):
            raise ValueError(f"{text!r} is no {self.value_type.__name__}")
        return value
