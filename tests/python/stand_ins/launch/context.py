"""Where arguments live while a description is visited, and the visit."""


class LaunchContext:
    """Values of the arguments by name, the nodes that would be started, and the lines that would be written."""

    def __init__(self, given):
        self.launch_configurations = dict(given)
        self.nodes, self.lines = [], []


def visit(entities, context):
    """Executes entities one after the other, and what they return."""
    for entity in entities:
        if entity.condition is None or entity.condition.evaluate(context):
            visit(entity.execute(context) or [], context)
