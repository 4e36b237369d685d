/**
 * The tip of the stylus, live: a ball of its size, a shadow of it while the part hides it, the measured force as an arrow, and the green
 * arrow onto the next touch.
 */
import { Group, Mesh, MeshBasicMaterial, MeshLambertMaterial, SphereGeometry, Vector3 } from "three";
import { Arrow } from "./arrow";
import { type Marker, type Mismatch, triple, type Xyz } from "./messages";

/** Numbers of the markers on the topic `tip`. */
const BALL = 0;
const TEXT = 1;
const NEXT = 3;
const DELETE = 2;

/** Length of the force's arrow for 1 N, in radii of the tip. */
const PER_NEWTON = 2.5;
/** Smaller forces are invisible and imperceptible, N. */
const LEAST_FORCE = 0.02;

const COLOURS = { tip: "#d55e00", force: "#cc79a7", next: "#00b37d" };

export interface TipState {
  /** m; null while no tip is there. */
  place: Vector3 | null;
  radius: number;
  /** To the surface, m; null far from it. */
  distance: number | null;
  /** Where to touch next, m. */
  next: Vector3 | null;
  /** Against the last measured force, N. */
  force: number;
}

export class TipView extends Group {
  readonly state: TipState = { place: null, radius: 1e-3, distance: null, next: null, force: 0 };
  private readonly ball = new Mesh(new SphereGeometry(1, 32, 20), new MeshLambertMaterial({ color: COLOURS.tip }));
  private readonly shadow = new Mesh(
    this.ball.geometry,
    new MeshBasicMaterial({ color: COLOURS.tip, transparent: true, opacity: 0.28, depthTest: false, depthWrite: false }),
  );
  private readonly forceArrow = new Arrow(COLOURS.force);
  private readonly nextArrow = new Arrow(COLOURS.next);

  constructor() {
    super();
    this.ball.visible = this.shadow.visible = false;
    this.add(this.ball, this.shadow, this.forceArrow, this.nextArrow);
  }

  markers(markers: Marker[]): void {
    for (const marker of markers) {
      const isGone = marker.action >= DELETE;
      if (marker.id === BALL) this.placeBall(isGone ? null : vector(marker.pose.position), (marker.scale.x ?? 0) / 2);
      else if (marker.id === TEXT) this.state.distance = isGone ? null : distanceIn(marker.text);
      else if (marker.id === NEXT) this.placeNext(isGone ? [] : marker.points);
    }
  }

  mismatch(message: Mismatch): void {
    const force = vector(message.actual_force) ?? new Vector3();
    this.state.force = force.length();
    const tip = vector(message.tip);
    if (tip === null || this.state.force < LEAST_FORCE || this.state.place === null) {
      this.forceArrow.visible = false;
      return;
    }
    const { radius } = this.state;
    const to = tip.clone().addScaledVector(force, PER_NEWTON * radius);
    this.forceArrow.place(tip, to, radius / 3);
  }

  private placeBall(place: Vector3 | null, radius: number): void {
    this.state.place = place;
    this.ball.visible = this.shadow.visible = place !== null;
    if (place === null) {
      this.forceArrow.visible = false;
      return;
    }
    this.state.radius = radius;
    for (const ball of [this.ball, this.shadow]) {
      ball.position.copy(place);
      ball.scale.setScalar(radius);
    }
  }

  private placeNext(points: Xyz[]): void {
    const [from, to] = points.map(vector);
    this.state.next = to ?? null;
    this.nextArrow.visible = false;
    if (from && to) this.nextArrow.place(from, to, Math.min(from.distanceTo(to) / 9, 0.7 * this.state.radius));
  }
}

function vector(at: Xyz): Vector3 | null {
  const numbers = triple(at);
  return numbers === null ? null : new Vector3(...numbers);
}

/** The text at the tip begins with its distance in mm: "0.12 mm; hole Ø8.02 ± 0.04". */
export function distanceIn(text: string): number | null {
  const found = /^(-?\d+(?:\.\d+)?) mm/.exec(text);
  return found === null ? null : Number(found[1]) / 1e3;
}
