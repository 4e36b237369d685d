"""python -m changed OUT: makes changed recordings. python -m changed OUT --score --checker TOUCHUP: checks them by `touchup doctor`."""

import argparse
import json
from pathlib import Path

from .causes import CONTROLS
from .make import make_all
from .score import score_all
from .table import print_table

CASES = Path(__file__).resolve().parents[4] / "shared" / "data" / "cases"


def names(text):
    return text.split(",")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--data", type=Path, default=CASES, help="folder of the cases")
    parser.add_argument("--cases", type=names, default=["plate", "featuretype", "flange"])
    parser.add_argument("--kinds", type=names, default=[], help="with commas between; all, if left out")
    parser.add_argument("--sizes", type=names, default=[], help="of small, middle, large, whole; all, if left out")
    parser.add_argument("--turn-deg", type=float, default=70.0, help="largest turn of the stylus besides its own")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--score", action="store_true")
    parser.add_argument("--checker", type=Path, default=Path("touchup"))
    parser.add_argument("--json", type=Path, help="file for all lines of the score")
    told = parser.parse_args()
    if told.score:
        lines = score_all([folder for folder in folders(told.out) if is_asked(folder, told)], told.data, told.checker, told.workers)
        if told.json:
            told.json.write_text(json.dumps(lines, indent=1) + "\n")
        print_table(lines)
    else:
        count = make_all(told.out, [told.data / case for case in told.cases], told.kinds, told.sizes, told.turn_deg, told.workers)
        print(f"{count} folders in {told.out}")


def folders(out):
    return [change.parent for change in sorted(out.glob("*/change.json"))]


def is_asked(folder, told):
    case, kind, size = folder.name.split("__")
    is_of_size = not told.sizes or size in told.sizes or kind in CONTROLS
    return case in told.cases and (not told.kinds or kind in told.kinds) and is_of_size


if __name__ == "__main__":
    main()
