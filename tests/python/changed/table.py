"""The score as a table on stdout."""

import numpy as np

from .causes import CAUSES_OF
from .make import SIZES

# of a normal distribution, 95 % within
SIGMAS = 1.96
# standard uncertainty, mm or °, of what the program calls unknown
UNKNOWN = 5


def errors(line):
    """Errors in standard uncertainties, by name, of the numbers that are known."""
    sized = {name: of for name, of in line["numbers"].items() if 0 < of["sigma"] < (UNKNOWN if name.endswith(("_mm", "_deg")) else np.inf)}
    return {name: (of["found"] - of["true"]) / of["sigma"] for name, of in sized.items()}


def cell(line):
    """`!` sure, `?` doubtful; `x` wrong; number of further causes; largest error in standard uncertainties."""
    if line is None:
        return ""
    if "error" in line:
        return "FAILED"
    if not line["causes"]:
        return "."
    right = "" if line["is_right"] else "x "
    more = f" +{len(line['causes']) - 1}" if len(line["causes"]) > 1 else ""
    off = errors(line).values()
    off = f" {max(map(abs, off)):.1f}σ" if off else ""
    return f"{right}{line['causes'][0]}{'!' if line['is_sure'] else '?'}{more}{off}"


def print_table(lines):
    cases = list(dict.fromkeys(line["case"] for line in lines))
    of = {(line["kind"], line["size"], line["case"]): line for line in lines}
    rows = sorted(dict.fromkeys((line["kind"], line["size"]) for line in lines), key=lambda row: (row[0], SIZES.index(row[1])))
    table = [["kind", "size", *cases]] + [[*row, *(cell(of.get((*row, case))) for case in cases)] for row in rows]
    print_aligned(table)
    changed, controls = [[line for line in lines if line["is_control"] == is_control] for is_control in (False, True)]
    if changed:
        print_shares(changed, "kind", dict.fromkeys(line["kind"] for line in changed), "accepted")
        print_shares(changed, "size", [size for size in SIZES if any(line["size"] == size for line in changed)], "")
        print_failures([line for line in changed if line["size"] in ("middle", "whole") and not line["is_right"]])
    print_controls(controls)


def print_aligned(table):
    widths = [max(len(row[at]) for row in table) for at in range(len(table[0]))]
    for row in table:
        print("  ".join(text.ljust(width) for text, width in zip(row, widths)).rstrip())


def shares(lines):
    """Named, sure, right; numbers within; mean error of the time of a change."""
    count = len(lines)
    names = ("is_named", "is_sure", "is_right")
    of = [f"{100 * sum(line[name] for line in lines) / count:.0f} %" for name in names]
    off = [size for line in lines if line["is_right"] for size in errors(line).values()]
    within = f"{100 * sum(abs(size) <= SIGMAS for size in off) / len(off):.0f} % of {len(off)}" if off else "-"
    late = [line["numbers"]["at_s"] for line in lines if line["is_right"] and "at_s" in line["numbers"]]
    late = [abs(of["found"] - of["true"]) for of in late]
    return [str(count), *of, within, f"{sorted(late)[len(late) // 2]:.2f} s" if late else "-"]


def print_shares(lines, by, names, note):
    """A row for each of these kinds or sizes."""
    titles = [by, "of", "named", "sure", "right", f"numbers within {SIGMAS} σ", "median error of at_s", note]
    rows = [[name, *shares([line for line in lines if line[by] == name])] for name in names]
    print(f"\nEach {by}; numbers of the rightly named ones:")
    print_aligned([titles] + [[*row, ", ".join(CAUSES_OF.get(row[0], ()))] for row in rows + [["all", *shares(lines)]]])


def print_failures(lines):
    print(f"\nMiddle or whole, and not named rightly: {len(lines)}")
    for line in lines:
        print(f"  {line['folder']}: {line['what']}")
        for said in line.get("said") or [line.get("error", "nothing said")]:
            print(f"      {said}")


def print_controls(lines):
    loud = [line for line in lines if line["is_named"] or "error" in line]
    print(f"\nControls with findings: {len(loud)} of {len(lines)}")
    for line in loud:
        print(f"  !!! {line['folder']}")
        for said in line.get("said") or [line["error"]]:
            print(f"  !!!   {said}")
