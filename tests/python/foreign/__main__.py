"""python -m foreign FOLDER --seed N --sides z,x,-y: scans and touches FOLDER/part.stl, mm."""

import argparse
from pathlib import Path

import trimesh

from .world import simulate


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sides", default="z", help="sides from which the hand reaches the part")
    arguments = parser.parse_args()
    simulate(trimesh.load(arguments.folder / "part.stl"), arguments.folder, arguments.seed, arguments.sides.split(","))


if __name__ == "__main__":
    main()
