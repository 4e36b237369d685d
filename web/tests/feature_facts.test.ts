/** Words and needs of a feature, on cases worked by hand. */
import { describe, expect, it } from "vitest";
import { isAsked, isMinor, mainWords, need, nearestTo, sizes, title, urgency } from "../src/feature_facts";
import { FittedTo, Kind, type NotedFeature, Status } from "../src/messages";
import { likeWhat } from "../src/size_words";
import { distanceIn } from "../src/tip_view";
import { Vector3 } from "three";

const nowhere = { x: null, y: null, z: null };

function feature(given: Partial<NotedFeature>): NotedFeature {
  return {
    id: 3, kind: Kind.hole, status: Status.found, fitted_to: FittedTo.touches, touched: 0.5, touch_count: 8, search_radius: null,
    center: { x: 0, y: 0, z: 0 }, center_std: null, axis: nowhere, axis_std: null, direction: nowhere, diameter: null,
    diameter_std: null, length: null, length_std: null, width: null, width_std: null, depth: null, depth_std: null,
    depth_is_at_least: false, cone_angle: null, cone_angle_std: null, through: 0, convex: 0, group: -1, points: [], form: [],
    name: "", mark: "none", is_locked: false, ...given,
  };
}

const hole = feature({ diameter: 8.02e-3, diameter_std: 12e-6, depth: 5e-3, depth_std: 40e-6, depth_is_at_least: true });
const slot = feature({ kind: Kind.slot, width: 6e-3, width_std: 5e-6, length: 20e-3, length_std: 50e-6 });
const plain = (words: string): string => words.replaceAll("\u00a0", " ");

describe("a feature in words", () => {
  it("has its main size first, with U, and bounds as bounds", () => {
    expect(plain(mainWords(hole))).toBe("Ø 8.020 ± 0.024 mm");
    expect(sizes(hole).map((size) => plain(size.words))).toEqual(["8.020 ± 0.024 mm", "≥ 5.00 mm"]);
    expect(plain(mainWords(slot))).toBe("6.000 ± 0.010 × 20.00 ± 0.10 mm");
  });

  it("has its name behind its number", () => {
    expect([title(hole), title({ ...hole, name: "left" })]).toEqual(["Hole 3", "Hole 3 · left"]);
  });
});

describe("what it wants", () => {
  it("is its widest number, bounds left out", () => {
    expect(need(hole, 20e-6)).toEqual({ kind: "wide", size: "diameter", u: 24e-6 });
    expect(need(hole, 24e-6)).toBeNull();
    expect(need(slot, 20e-6)).toEqual({ kind: "wide", size: "length", u: 100e-6 });
    expect(urgency(slot, 20e-6)).toBeCloseTo(5);
  });

  it("is a first touch where nothing was touched, and a number of touches where U is not known", () => {
    expect(need({ ...hole, fitted_to: FittedTo.mesh, touched: 0 }, 1)).toEqual({ kind: "untouched" });
    expect(need({ ...hole, fitted_to: FittedTo.mesh, touched: 0.1 }, 1)).toEqual({ kind: "little", share: 0.1 });
    expect(need({ ...hole, diameter_std: null }, 1)).toEqual({ kind: "unknown", touches: 8 });
    expect(urgency({ ...hole, status: Status.flagged, touch_count: 0 }, 1)).toBe(Infinity);
  });

  it("is nothing of edges that nobody flagged, and of what was thrown out", () => {
    const edge = feature({ kind: Kind.edge });
    expect([isMinor(edge), isMinor({ ...edge, status: Status.flagged })]).toEqual([true, false]);
    expect([isAsked(hole), isAsked({ ...hole, mark: "rejected" }), isAsked(edge)]).toEqual([true, false, false]);
  });
});

describe("near the tip", () => {
  it("is the feature with the nearest center, if any is near", () => {
    const far = feature({ id: 4, center: { x: 0.1, y: 0, z: 0 } });
    expect(nearestTo(new Vector3(0.08, 0, 0), [hole, far], 0.05)?.id).toBe(4);
    expect(nearestTo(new Vector3(0.2, 0, 0), [hole, far], 0.05)).toBeNull();
  });

  it("the distance is what the marker's text begins with", () => {
    expect(distanceIn("-0.12 mm; hole Ø8.02 ± 0.04")).toBeCloseTo(-0.12e-3);
    expect(distanceIn("far from the mesh")).toBeNull();
  });
});

describe("the size of a part", () => {
  it("taken in a wrong unit is like something else", () => {
    const right = likeWhat(0.08);
    for (const factor of [25.4, 1000, 1 / 25.4, 1 / 1000]) expect(likeWhat(0.08 * factor)).not.toBe(right);
  });
});
