"""Touches that share their error: together they weigh as one in the program's fits, and so in those that check them."""

# touches of one stroke within this time share their error
SHARED_NS = 100_000_000


def groups_of(touches):
    """The group of each of these lines of the file of touches, numbers from 0 in their order."""
    groups, begun = [], (None, 0)
    for touch in touches:
        stroke, stamp = touch["stroke"], int(touch["stamp_ns"])
        if not groups or stroke != begun[0] or stamp - begun[1] >= SHARED_NS:
            begun = (stroke, stamp)
            groups.append(groups[-1] + 1 if groups else 0)
        else:
            groups.append(groups[-1])
    return groups
