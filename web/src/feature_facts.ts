/** Facts of a feature for an operator: its name, its sizes with U, and the number that needs touches most. */
import { Vector3 } from "three";
import { t } from "./language";
import { type NotedFeature, FittedTo, Kind, Status, triple } from "./messages";
import { angle, expanded, length } from "./numbers";
import type { TextKey } from "./texts";

const KIND_TEXTS: TextKey[] = [
  "kindUnknown", "kindHole", "kindSlot", "kindPocket", "kindBoss", "kindEdge", "kindCorner", "kindPlane", "kindCylinder", "kindNotch",
  "kindSphere",
];

/** Kinds for a flag, the likeliest first. */
export const FLAGGABLE = [
  Kind.hole, Kind.slot, Kind.pocket, Kind.boss, Kind.edge, Kind.corner, Kind.plane, Kind.cylinder, Kind.notch, Kind.sphere,
  Kind.unknown,
];

export function kindText(kind: number): TextKey {
  return KIND_TEXTS[kind] ?? "kindUnknown";
}

/** "Hole 3", or "Hole 3 · upper left" with a name of its own. */
export function title(feature: NotedFeature): string {
  const plain = `${t(kindText(feature.kind))} ${feature.id}`;
  return feature.name ? `${plain} · ${feature.name}` : plain;
}

/** A part has dozens of edges, corners and planes: they speak for themselves. */
export function isMinor(feature: NotedFeature): boolean {
  const { kind, status } = feature;
  return (kind === Kind.edge || kind === Kind.corner || kind === Kind.plane) && status === Status.found;
}

export interface Size {
  text: TextKey;
  /** With U and unit. */
  words: string;
  value: number;
  /** Expanded uncertainty, m; null if unknown. */
  u: number | null;
  isAtLeast: boolean;
}

/** Every known length of it, the principal one first. */
export function sizes(feature: NotedFeature): Size[] {
  const size = (name: "diameter" | "width" | "length" | "depth"): Size | null => {
    const isAtLeast = name === "depth" && feature.depth_is_at_least;
    const [value, std] = [feature[name], feature[`${name}_std`]];
    const words = length(value, isAtLeast ? null : std, isAtLeast);
    const text = name === "depth" && feature.kind === Kind.boss ? "height" : name;
    return words === null ? null : { text, words, value: value ?? 0, u: expanded(std), isAtLeast };
  };
  return (["diameter", "width", "length", "depth"] as const).map(size).filter((each) => each !== null);
}

/** "Ø 8.021 ± 0.025 mm", "6.00 × 20.0 mm": its main numbers in one line. */
export function mainWords(feature: NotedFeature): string {
  if (feature.status === Status.flagged) return t("notMeasured");
  const [first, second] = sizes(feature).filter((size) => size.text !== "depth" && size.text !== "height");
  if (first === undefined) return length(feature.depth, feature.depth_std, feature.depth_is_at_least) ?? "";
  if (first.text === "diameter") return `Ø ${first.words}`;
  return second === undefined ? first.words : `${first.words.replace("\u00a0mm", "")} × ${second.words}`;
}

export function coneWords(feature: NotedFeature): string | null {
  return angle(feature.cone_angle, feature.cone_angle_std);
}

/** Why a feature needs touches. */
export type Need =
  | { kind: "untouched" }
  | { kind: "little"; share: number }
  | { kind: "unknown"; touches: number }
  | { kind: "wide"; size: TextKey; u: number };

/** Greatest need of a feature; null if all of its numbers are within the tolerance (m, of U). */
export function need(feature: NotedFeature, tolerance: number): Need | null {
  if (feature.status === Status.flagged || feature.fitted_to !== FittedTo.touches) {
    // too few touches for numbers from touches
    return (feature.touched ?? 0) > 0 ? { kind: "little", share: feature.touched ?? 0 } : { kind: "untouched" };
  }
  const asked = sizes(feature).filter((size) => !size.isAtLeast);
  const [widest] = asked.sort((a, b) => (b.u ?? Infinity) - (a.u ?? Infinity));
  if (widest === undefined) return null;
  if (widest.u === null) return { kind: "unknown", touches: feature.touch_count };
  return widest.u <= tolerance ? null : { kind: "wide", size: widest.text, u: widest.u };
}

/** Whether the tolerance applies to it: it has a size, and no rejection. */
export function isAsked(feature: NotedFeature): boolean {
  return !isMinor(feature) && feature.mark !== "rejected";
}

/** Urgency of touches on a feature: U over the tolerance, infinite without a number. */
export function urgency(feature: NotedFeature, tolerance: number): number {
  const wanted = need(feature, tolerance);
  if (wanted === null) return 0;
  return wanted.kind === "wide" ? wanted.u / tolerance : Infinity;
}

/** The one with the nearest center, among those under the tolerance. @param within largest distance, m. */
export function nearestTo(place: Vector3, features: NotedFeature[], within: number): NotedFeature | null {
  let nearest: NotedFeature | null = null;
  let least = within;
  for (const feature of features) {
    const center = triple(feature.center);
    if (center === null || isMinor(feature)) continue;
    const distance = place.distanceTo(new Vector3(...center));
    if (distance < least) [nearest, least] = [feature, distance];
  }
  return nearest;
}
