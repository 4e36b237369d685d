/**
 * Moves the camera: turn, shift and zoom by touch, mouse and keyboard, named views, and following the tip.
 */
import { Spherical, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { MeshStore } from "./mesh_store";
import type { Stage } from "./stage";

export type ViewName = "whole" | "top" | "front" | "side";

/** From the part to the camera. Not quite from above: there the camera would have no upward direction. */
const DIRECTIONS: Record<ViewName, Vector3> = {
  whole: new Vector3(0.55, -1, 0.85),
  top: new Vector3(0, -1e-3, 1),
  front: new Vector3(0, -1, 0),
  side: new Vector3(1, 0, 0),
};
/** One press of an arrow key turns by this, rad. */
const TURN = Math.PI / 24;
/** One press of plus or minus zooms by this. */
const ZOOM = 1.2;
/** Room around the whole part. */
const MARGIN = 1.12;
/** Share of the way to the tip that the camera goes in each message. */
const FOLLOW = 0.3;

export class CameraMan {
  follows = false;
  /** Called when a hand on the part ends the following. */
  onFreed: () => void = () => {};
  private readonly controls: OrbitControls;
  private hasFramed = false;

  constructor(
    private readonly stage: Stage,
    private readonly store: MeshStore,
  ) {
    this.controls = new OrbitControls(stage.camera, stage.canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener("change", () => stage.ask());
    stage.canvas.addEventListener("keydown", (event) => this.key(event));
    stage.beforeFrame.push(() => this.keepInReach());
  }

  /** Has the whole part in the picture, from one of the named sides. */
  show(name: ViewName): void {
    if (this.radius() === null) return;
    const middle = this.middle();
    const { camera } = this.stage;
    camera.position.copy(DIRECTIONS[name]).add(middle);
    camera.lookAt(middle);
    camera.position.copy(DIRECTIONS[name]).setLength(MARGIN * this.distanceForAll()).add(middle);
    this.controls.target.copy(middle);
    this.free();
    this.controls.update();
    this.hasFramed = true;
    this.stage.ask();
  }

  /** Shows all of the part at its first sight. */
  frameOnce(): void {
    if (!this.hasFramed && this.radius() !== null) this.show("whole");
  }

  /** Have the next part framed anew, for it may be another one. */
  forget(): void {
    this.hasFramed = false;
  }

  tipAt(place: Vector3): void {
    if (!this.follows) return;
    const step = place.clone().sub(this.controls.target).multiplyScalar(FOLLOW);
    this.controls.target.add(step);
    this.stage.camera.position.add(step);
    this.controls.update();
  }

  lookAt(place: Vector3): void {
    const step = place.clone().sub(this.controls.target);
    this.controls.target.add(step);
    this.stage.camera.position.add(step);
    this.controls.update();
    this.stage.ask();
  }

  private free(): void {
    if (!this.follows) return;
    this.follows = false;
    this.onFreed();
  }

  private key(event: KeyboardEvent): void {
    const { key, shiftKey } = event;
    const turns: Record<string, [number, number]> = {
      ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1],
    };
    const turn = turns[key];
    if (turn !== undefined) shiftKey ? this.shift(turn[0], turn[1]) : this.turn(TURN * turn[0], TURN * turn[1]);
    else if (key === "+" || key === "=") this.zoom(1 / ZOOM);
    else if (key === "-") this.zoom(ZOOM);
    else return;
    event.preventDefault();
    this.controls.update();
    this.stage.ask();
  }

  private turn(around: number, up: number): void {
    const { position } = this.stage.camera;
    const offset = position.clone().sub(this.controls.target);
    // Spherical has y up, the page z
    const turned = new Spherical().setFromCartesianCoords(offset.y, offset.z, offset.x);
    turned.theta += around;
    turned.phi = Math.min(Math.max(turned.phi + up, 1e-3), Math.PI - 1e-3);
    const { x, y, z } = new Vector3().setFromSpherical(turned);
    position.set(z, x, y).add(this.controls.target);
  }

  private shift(right: number, down: number): void {
    const { camera } = this.stage;
    const far = camera.position.distanceTo(this.controls.target) / 12;
    const step = new Vector3(right, -down, 0).multiplyScalar(far).applyQuaternion(camera.quaternion);
    camera.position.add(step);
    this.controls.target.add(step);
    this.free();
  }

  private zoom(by: number): void {
    const { position } = this.stage.camera;
    position.sub(this.controls.target).multiplyScalar(by).add(this.controls.target);
  }

  /** Near and far planes for the place of the camera: the depth of the picture is finite. */
  private keepInReach(): void {
    const radius = this.radius();
    if (radius === null) return;
    const { camera } = this.stage;
    const distance = camera.position.distanceTo(this.middle());
    const near = Math.max(distance - 2 * radius, radius / 500);
    const far = distance + 4 * radius;
    if (Math.abs(near / camera.near - 1) < 1e-3 && Math.abs(far / camera.far - 1) < 1e-3) return;
    camera.near = near;
    camera.far = far;
    camera.updateProjectionMatrix();
  }

  /** From the middle of the part, so that every corner of its box is in the picture at the camera's present turn. */
  private distanceForAll(): number {
    const { camera } = this.stage;
    const { low, high } = this.store;
    const tall = Math.tan((camera.fov * Math.PI) / 360);
    const back = camera.quaternion.clone().invert();
    let distance = 0;
    for (let corner = 0; corner < 8; corner++) {
      const at = [0, 1, 2].map((axis) => ((corner >> axis) & 1 ? 0.5 : -0.5) * (high[axis] - low[axis]));
      const seen = new Vector3(...at).applyQuaternion(back);
      distance = Math.max(distance, seen.z + Math.max(Math.abs(seen.y), Math.abs(seen.x) / camera.aspect) / tall);
    }
    return distance;
  }

  private middle(): Vector3 {
    const { low, high } = this.store;
    return new Vector3((low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2);
  }

  private radius(): number | null {
    const { low, high } = this.store;
    const diagonal = Math.hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
    return Number.isFinite(diagonal) && diagonal > 0 ? diagonal / 2 : null;
  }
}
