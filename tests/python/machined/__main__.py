"""python -m machined TOUCHUP OUT [--seeds A-B] [--worlds W,...] [--scanner cheap|good]: parts scanned, touched, refined and judged.

Each part has its own folder: the true part, its scan and recording by `touchup simulate` or by the world `foreign`, refined mesh, features
and touches. A folder with a recording goes through refinement again, not through simulation. Prints missed and invented features,
and a table; --json writes the same for `machined.plots` and `machined.failures`.
"""

import argparse
import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from .touched import WORLDS, Failed, Totals, part_run


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("touchup", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--seeds", default="0-23")
    parser.add_argument("--worlds", default=",".join(WORLDS), help="worlds of touchup simulate; plain: none; foreign: python -m foreign")
    parser.add_argument("--scanner", choices=["cheap", "good"])
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--json", type=Path, help="verdicts, one for each part")
    arguments = parser.parse_args()
    low, high = map(int, arguments.seeds.split("-"))
    worlds = [None if name == "plain" else name for name in arguments.worlds.split(",")]
    jobs = [(seed, world) for seed in range(low, high + 1) for world in worlds]

    def one(job):
        try:
            return part_run(arguments.touchup.resolve(), arguments.out, *job, arguments.scanner)
        except Failed as failure:
            return f"{job[0]} {job[1] or 'plain'}: failed: {str(failure).strip()}"

    totals, failed, verdicts = Totals(), 0, []
    with ThreadPoolExecutor(arguments.jobs) as pool:
        for result in pool.map(one, jobs):
            if isinstance(result, str):
                failed += 1
                print(result, flush=True)
                continue
            totals.add(result)
            verdicts.append(result.record())
            for line in result.lines():
                print(line, flush=True)
    if arguments.json:
        arguments.json.write_text(json.dumps(verdicts, indent=1))
    print(f"\n{totals.table()}\n{failed} of {len(jobs)} failed")


if __name__ == "__main__":
    main()
