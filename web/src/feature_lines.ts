/**
 * Features as lines on the part: rims of holes and bosses, outlines of slots and pockets, edges, and dashed circles around flags. And the
 * planned path of the arm. Lines are some pixels wide, at any distance of the camera.
 */
import { Color, Vector3 } from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import { type Feature, FittedTo, Kind, Status, triple, type Xyz } from "./messages";

/** Corners of a circle. */
const CORNERS = 48;
/** Off the surface, as a share of the feature's size, so that it is not half hidden. */
const RAISED = 0.004;

export const FEATURE_COLOURS = { flagged: "#a2058a", touched: "#0a3fd6", mesh: "#00788a", selected: "#d55e00", path: "#7a3fb0", touch: "#e00000" };

export class Lines extends LineSegments2 {
  constructor(width: number) {
    const material = new LineMaterial({ linewidth: width, vertexColors: true });
    super(new LineSegmentsGeometry(), material);
    this.frustumCulled = false;
    this.visible = false;
  }

  /** @param places two for each piece, x y z; colours likewise, one for each end. */
  draw(places: number[], colours: number[]): void {
    this.visible = places.length > 0;
    if (!this.visible) return;
    const geometry = new LineSegmentsGeometry();
    geometry.setPositions(places);
    geometry.setColors(colours);
    this.geometry.dispose();
    this.geometry = geometry;
  }
}

/** Lines of all visible features; the selected one in its own colour. */
export function drawFeatures(lines: Lines, features: Feature[], selected: number | null): void {
  const places: number[] = [];
  const colours: number[] = [];
  for (const feature of features) {
    const colour = new Color(feature.id === selected ? FEATURE_COLOURS.selected : colourOf(feature));
    const outline = outlineOf(feature);
    for (let i = 0; i + 1 < outline.length; i++) {
      // a flag has dashes: it is a wish, not a measurement
      if (feature.status === Status.flagged && i % 2 === 1) continue;
      places.push(...outline[i].toArray(), ...outline[i + 1].toArray());
      for (let end = 0; end < 2; end++) colours.push(colour.r, colour.g, colour.b);
    }
  }
  lines.draw(places, colours);
}

/** A path as lines, with a small barb on each piece that says which way. */
export function drawPath(lines: Lines, stops: Xyz[], size: number): void {
  const places: number[] = [];
  const line = stops.map(triple).filter((stop) => stop !== null).map((stop) => new Vector3(...stop));
  for (let i = 0; i + 1 < line.length; i++) {
    const [from, to] = [line[i], line[i + 1]];
    places.push(...from.toArray(), ...to.toArray());
    const along = to.clone().sub(from);
    if (along.length() < 2 * size) continue;
    const middle = from.clone().addScaledVector(along, 0.5);
    along.setLength(size);
    const [across, up] = frame(along);
    for (const side of [across, across.clone().negate(), up, up.clone().negate()]) {
      places.push(...middle.toArray(), ...middle.clone().sub(along).addScaledVector(side, size / 2).toArray());
    }
  }
  const { r, g, b } = new Color(FEATURE_COLOURS.path);
  lines.draw(places, Array.from({ length: places.length / 3 }, () => [r, g, b]).flat());
}

/** A touch as a line through its contacts. */
export function drawTouch(lines: Lines, contacts: Xyz[]): void {
  const line = contacts.map(triple).filter((contact) => contact !== null);
  const places = line.slice(1).flatMap((to, i) => [...line[i], ...to]);
  const { r, g, b } = new Color(FEATURE_COLOURS.touch);
  lines.draw(places, Array.from({ length: places.length / 3 }, () => [r, g, b]).flat());
}

function colourOf(feature: Feature): string {
  if (feature.status === Status.flagged) return FEATURE_COLOURS.flagged;
  return feature.fitted_to === FittedTo.touches ? FEATURE_COLOURS.touched : FEATURE_COLOURS.mesh;
}

function outlineOf(feature: Feature): Vector3[] {
  const center = triple(feature.center);
  if (center === null) return [];
  const middle = new Vector3(...center);
  const axis = new Vector3(...(triple(feature.axis) ?? [0, 0, 1]));
  if (feature.status === Status.flagged) return circle(middle, axis, feature.search_radius ?? 0);
  if (feature.diameter !== null) return circle(middle, axis, feature.diameter / 2);
  const along = triple(feature.direction);
  if (feature.width !== null && feature.length !== null && along !== null) {
    const isRound = feature.kind === Kind.slot;
    return stadium(middle, axis, new Vector3(...along), feature.length, feature.width, isRound);
  }
  return feature.points.map(triple).filter((point) => point !== null).map((point) => new Vector3(...point));
}

function circle(middle: Vector3, axis: Vector3, radius: number): Vector3[] {
  const [across, up] = frame(axis);
  const raised = middle.clone().addScaledVector(axis, 2 * RAISED * radius);
  return Array.from({ length: CORNERS + 1 }, (_, i) => {
    const turn = (2 * Math.PI * i) / CORNERS;
    return raised.clone().addScaledVector(across, radius * Math.cos(turn)).addScaledVector(up, radius * Math.sin(turn));
  });
}

/** Outline of a slot (round ends) or of a pocket (a rectangle). */
function stadium(middle: Vector3, axis: Vector3, along: Vector3, length: number, width: number, isRound: boolean): Vector3[] {
  const across = axis.clone().cross(along).normalize();
  const raised = middle.clone().addScaledVector(axis, RAISED * width);
  const radius = width / 2;
  const at = (x: number, y: number): Vector3 => raised.clone().addScaledVector(along, x).addScaledVector(across, y);
  if (!isRound) {
    const [x, y] = [length / 2, radius];
    return [at(-x, -y), at(x, -y), at(x, y), at(-x, y), at(-x, -y)];
  }
  const straight = length / 2 - radius;
  const half = CORNERS / 2;
  const end = (side: number): Vector3[] =>
    Array.from({ length: half + 1 }, (_, i) => {
      const turn = (Math.PI * i) / half - Math.PI / 2;
      return at(side * (straight + radius * Math.cos(turn)), side * radius * Math.sin(turn));
    });
  const outline = [...end(1), ...end(-1)];
  return [...outline, outline[0]];
}

/** Two unit vectors across a direction and one another. */
function frame(axis: Vector3): [Vector3, Vector3] {
  const across = Math.abs(axis.z) < 0.9 * axis.length() ? new Vector3(0, 0, 1) : new Vector3(1, 0, 0);
  across.cross(axis).normalize();
  return [across, axis.clone().cross(across).normalize()];
}
