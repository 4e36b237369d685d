"""python -m machined.plots OUT.png VERDICTS.json...: found and invented features, and errors over stated deviations, by kind and world.

The files are those of `python -m machined --json`. Bars give counts out of totals; an interval around a share is that of Wilson at 95 %,
one around a ratio that of the chi-squared distribution at 95 %. Grey bands are the requirements.
"""

import argparse
import json
from collections import defaultdict
from pathlib import Path

import matplotlib
import numpy as np
from scipy.stats import chi2

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

KINDS = ["hole", "slot", "pocket", "boss", "notch"]
# distinct without red or green, and by their brightness
COLOURS = ["#0072b2", "#e69f00", "#56b4e9", "#009e73", "#555555"]
FOUND, FALSE, RATIO = 0.97, 0.01, (0.8, 1.25)


def wilson(count, of):
    """Interval at 95 % of a share."""
    z = 1.96
    middle, half = count / of + z**2 / (2 * of), z * np.sqrt(count * (of - count) / of**3 + z**2 / (4 * of**2))
    return (middle - half) / (1 + z**2 / of), (middle + half) / (1 + z**2 / of)


def bars(axes, shares, worlds, labels):
    """Shares by label and world: {(label, world): (count, of)}."""
    width = 0.8 / len(worlds)
    for number, world in enumerate(worlds):
        for at, label in enumerate(labels):
            count, of = shares.get((label, world), (0, 0))
            if of == 0:
                continue
            x, share = at + (number - (len(worlds) - 1) / 2) * width, count / of
            low, high = wilson(count, of)
            axes.bar(x, share, 0.9 * width, color=COLOURS[number], label=world if at == 0 else None)
            axes.plot([x, x], [max(low, 0), min(high, 1)], color="black", linewidth=1)
            axes.text(x, -0.01, f"{count}/{of}", ha="center", va="top", fontsize=7, transform=axes.get_xaxis_transform())
    axes.set_xticks(range(len(labels)), labels)
    axes.tick_params("x", pad=12, length=0)


def found(axes, verdicts, worlds):
    shares = defaultdict(lambda: [0, 0])
    for verdict in verdicts:
        for one in verdict["required"]:
            shares[one["kind"], verdict["world"]][0] += one["is_found"]
            shares[one["kind"], verdict["world"]][1] += 1
    labels = [kind for kind in KINDS if any(key[0] == kind for key in shares)]
    bars(axes, shares, worlds, labels)
    axes.axhspan(FOUND, 1, color="0.85", zorder=0)
    axes.set(title="Required features that were found", ylabel="share", ylim=(0, 1.02))
    axes.legend(fontsize=8, loc="lower center", ncols=3, bbox_to_anchor=(0.5, -0.28), frameon=False)


def invented(axes, verdicts, worlds):
    counts = defaultdict(lambda: [0, 0])
    for verdict in verdicts:
        real = sum(one["is_found"] for one in verdict["required"])
        for fitted_to in ("touches", "mesh"):
            false = sum(one["fitted_to"] == fitted_to for one in verdict["false"])
            counts[fitted_to, verdict["world"]][0] += false
            counts[fitted_to, verdict["world"]][1] += real + len(verdict["false"])
    bars(axes, counts, worlds, ["touches", "mesh"])
    axes.axhspan(0, FALSE, color="0.85", zorder=0)
    axes.set(title="Features that are not there, by what they are fitted to", ylabel="share of what was found", ylim=(0, None))


def ratios(axes, verdicts, worlds):
    values = defaultdict(list)
    for verdict in verdicts:
        for one in verdict["errors"]:
            values[f"{one['kind']} {one['number'].removesuffix('_mm')}", verdict["world"]].append(one["error_mm"] / one["std_mm"])
    labels = sorted({key[0] for key in values}, key=lambda label: (KINDS.index(label.split()[0]), label))
    for number, world in enumerate(worlds):
        for at, label in enumerate(labels):
            of = np.array(values.get((label, world), []))
            if not len(of):
                continue
            y = at + (number - (len(worlds) - 1) / 2) * 0.22
            ratio = np.sqrt(np.mean(of**2))
            ends = ratio * np.sqrt(len(of) / chi2.ppf([0.975, 0.025], len(of)))
            axes.plot(ends, [y, y], color=COLOURS[number], linewidth=1.5)
            axes.plot(ratio, y, "o", color=COLOURS[number], markersize=5, label=world if at == 0 else None)
            axes.text(1.01, y, f"{len(of)}", fontsize=7, va="center", color=COLOURS[number], transform=axes.get_yaxis_transform())
    axes.axvspan(*RATIO, color="0.85", zorder=0)
    axes.set_yticks(range(len(labels)), labels)
    axes.set(title="Error over stated standard deviation (rms; at the right their count)", xscale="log", xlim=(0.1, 10), xlabel="error / std")
    axes.set_xticks([0.1, 0.2, 0.5, 1, 2, 5, 10], ["0.1", "0.2", "0.5", "1", "2", "5", "10"])
    axes.invert_yaxis()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("verdicts", type=Path, nargs="+")
    arguments = parser.parse_args()
    verdicts = [verdict for path in arguments.verdicts for verdict in json.loads(path.read_text())]
    worlds = sorted({verdict["world"] for verdict in verdicts})
    figure = pyplot.figure(figsize=(12, 10), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=[2, 3])
    found(figure.add_subplot(grid[0, 0]), verdicts, worlds)
    invented(figure.add_subplot(grid[0, 1]), verdicts, worlds)
    ratios(figure.add_subplot(grid[1, :]), verdicts, worlds)
    figure.suptitle(f"{len(verdicts)} recordings of random machined parts")
    figure.savefig(arguments.out, dpi=100)


if __name__ == "__main__":
    main()
