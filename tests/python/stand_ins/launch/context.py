"""Arguments during the visit of a description, and the visit."""


class LaunchContext:
    """Values of the arguments by name, the nodes to start, and the lines to write."""

    def __init__(self, given):
        self.launch_configurations = dict(given)
        self.nodes, self.lines = [], []


def visit(entities, context):
    """Executes entities one after the other, and the entities that they return."""
    for entity in entities:
        if entity.condition is None or entity.condition.evaluate(context):
            visit(entity.execute(context) or [], context)
