/** An arrow in space, and lines of several pixels: the shapes of the tip, the force, the next touch and the path. */
import { ConeGeometry, CylinderGeometry, Group, Mesh, MeshLambertMaterial, Vector3 } from "three";

const UP = new Vector3(0, 1, 0);
/** Length and width of the head, in thicknesses of the shaft. */
const HEAD = { length: 6, width: 3 };

export class Arrow extends Group {
  private readonly shaft: Mesh;
  private readonly head: Mesh;

  constructor(colour: string) {
    super();
    const material = new MeshLambertMaterial({ color: colour, emissive: colour, emissiveIntensity: 0.35 });
    this.shaft = new Mesh(new CylinderGeometry(0.5, 0.5, 1, 12).translate(0, 0.5, 0), material);
    this.head = new Mesh(new ConeGeometry(0.5, 1, 20).translate(0, -0.5, 0), material);
    this.add(this.shaft, this.head);
    this.visible = false;
  }

  /** @param thickness of its shaft, m. */
  place(from: Vector3, to: Vector3, thickness: number): void {
    const along = to.clone().sub(from);
    const length = along.length();
    this.visible = length > 1e-9;
    if (!this.visible) return;
    const head = Math.min(HEAD.length * thickness, 0.6 * length);
    this.position.copy(from);
    this.quaternion.setFromUnitVectors(UP, along.divideScalar(length));
    this.shaft.scale.set(thickness, length - head, thickness);
    this.head.position.set(0, length, 0);
    this.head.scale.set(HEAD.width * thickness, head, HEAD.width * thickness);
  }
}
