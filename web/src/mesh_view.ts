/** The mesh on the GPU: the store's own arrays as buffers, with uploads of changed stretches alone. */
import { BufferAttribute, BufferGeometry, DynamicDrawUsage, Mesh, Sphere, Vector3 } from "three";
import type { ColourMode } from "./colours";
import type { DirtyRanges } from "./dirty_ranges";
import { MeshMaterial } from "./mesh_material";
import type { MeshStore } from "./mesh_store";

/** Calls to the driver for each buffer and frame at most. */
const MOST_RANGES = 24;

export class MeshView {
  readonly material = new MeshMaterial();
  readonly mesh = new Mesh(new BufferGeometry(), this.material);
  private generation = -1;
  private hasDeviation = false;

  constructor(private readonly store: MeshStore) {
    // the part is always looked at: to ask whether it is in view costs a pass over all vertices
    this.mesh.frustumCulled = false;
    this.mesh.visible = false;
  }

  colourBy(mode: ColourMode, scaleEnd: number): void {
    this.material.colourBy(mode, scaleEnd);
  }

  /** Before each frame: takes over the store's changes. */
  update(): void {
    const { store } = this;
    // until all parts of a change are here the last version stays in the picture
    if (!store.isWhole) return;
    this.mesh.visible = true;
    const hasDeviation = store.deviation !== null;
    if (this.generation !== store.generation || this.hasDeviation !== hasDeviation) this.rebuild();
    else this.markRanges();
    this.generation = store.generation;
    this.hasDeviation = hasDeviation;
    this.mesh.geometry.setDrawRange(0, 3 * store.faceEnd);
  }

  /** New buffers, as those of WebGL cannot grow. */
  private rebuild(): void {
    const { store } = this;
    const geometry = new BufferGeometry();
    const attribute = (array: Float32Array | Uint8Array | Uint32Array, size: number): BufferAttribute => {
      const made = new BufferAttribute(array, size);
      made.setUsage(DynamicDrawUsage);
      return made;
    };
    geometry.setAttribute("position", attribute(store.positions, 3));
    geometry.setAttribute("variance", attribute(store.variance, 1));
    geometry.setAttribute("quality", attribute(store.quality, 4));
    if (store.deviation !== null) geometry.setAttribute("deviation", attribute(store.deviation, 1));
    geometry.setIndex(attribute(store.corners, 1));
    // three.js asks for it when it sorts; the true one costs a pass over all vertices
    geometry.boundingSphere = new Sphere(new Vector3(), Infinity);
    this.mesh.geometry.dispose();
    this.mesh.geometry = geometry;
    store.dirtyVertices.take(1);
    store.dirtyFaces.take(1);
  }

  private markRanges(): void {
    const { geometry } = this.mesh;
    const { dirtyVertices, dirtyFaces } = this.store;
    upload(dirtyVertices, ["position", "variance", "quality", "deviation"].map((name) => geometry.getAttribute(name)));
    if (geometry.index !== null) upload(dirtyFaces, [geometry.index], 3);
  }
}

/** @param size numbers of the first attribute's arrays for each element that may be dirty; else its own item size. */
function upload(dirty: DirtyRanges, attributes: unknown[], size?: number): void {
  if (dirty.isEmpty) return;
  const ranges = dirty.take(MOST_RANGES);
  for (const attribute of attributes) {
    if (!(attribute instanceof BufferAttribute)) continue;
    const each = size ?? attribute.itemSize;
    for (const { start, count } of ranges) attribute.addUpdateRange(each * start, each * count);
    attribute.needsUpdate = true;
  }
}
