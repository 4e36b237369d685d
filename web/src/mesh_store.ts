/**
 * The mesh in the page: growing typed arrays, indexed by the node's own numbers of vertices and faces.
 *
 * It takes up patches as `msg/MeshPatch.msg` says: a whole state (from version 0) or a change of the present version. While a whole state
 * comes in its parts, the mesh before it stays visible; everything that the whole state did not name goes with its last part. So after a
 * lost connection the picture does not flicker.
 */
import { DirtyRanges } from "./dirty_ranges";
import type { MeshPatch } from "./mesh_patch";
import { WHICH, type VertexNumbers } from "./vertex_numbers";

/** The patch does not continue the mesh: the whole state has to come again. */
export class GapError extends Error {}

/** Bytes of `quality` for each vertex. */
export const QUALITY = { support: 0, outlier: 1, alive: 3 } as const;

/** Deviation, m, of a vertex that the nominal part is far from: no part is so large. */
export const FAR = 1e3;

/** Room beyond the request, so that not every new vertex makes the arrays grow. */
const SPARE = 1.25;

export class MeshStore {
  session = "";
  version = 0;
  vertexCount = 0;
  faceCount = 0;
  /** x y z of each vertex, m. */
  positions = new Float32Array(0);
  /** Along the normal, m²; -1 if unknown, since a GPU may not detect NaN. */
  variance = new Float32Array(0);
  /** Four bytes for each vertex: see `QUALITY`. */
  quality = new Uint8Array(0);
  /** Three vertices for each face; thrice the same for an absent one. */
  corners = new Uint32Array(0);
  /** One more than the largest number of a face ever given. */
  faceEnd = 0;
  /** Deviation from the nominal part, m, by vertex; null before the first measurement. */
  deviation: Float32Array | null = null;
  hasOutliers = false;
  /** Grows with each replacement of the arrays by larger ones. */
  generation = 0;
  dirtyVertices = new DirtyRanges(0);
  dirtyFaces = new DirtyRanges(0);
  /** Corners of a box around all vertices ever set, m. */
  readonly low = [Infinity, Infinity, Infinity];
  readonly high = [-Infinity, -Infinity, -Infinity];

  /** Vertices and faces in the parts of the whole state up to now; null between whole states. */
  private whole: { vertices: Uint8Array; faces: Uint8Array } | null = null;
  private nextPart = 0;
  /** How much of the whole state that is coming has come, 0 to 1. */
  progress = 0;

  /** Whether the mesh is that of a version: not between the parts of a change, with faces that may lack a vertex. */
  get isWhole(): boolean {
    return this.version > 0 && this.nextPart === 0;
  }

  /** @throws GapError if it does not continue the mesh, or its counts are wrong. */
  apply(patch: MeshPatch): void {
    if (!this.begins(patch)) return;
    this.reserve(patch);
    for (const face of patch.removedFaces) this.removeFace(face);
    this.setVertices(patch);
    this.setFaces(patch);
    for (const vertex of patch.removedVertices) this.removeVertex(vertex);
    this.nextPart = patch.part + 1;
    this.progress = this.nextPart / patch.partCount;
    if (this.nextPart < patch.partCount) return;
    this.nextPart = 0;
    this.sweep();
    this.version = patch.version;
    if (this.vertexCount !== patch.vertexCount || this.faceCount !== patch.faceCount) {
      const here = `${this.vertexCount} vertices and ${this.faceCount} faces`;
      this.version = 0;
      throw new GapError(`version ${patch.version} has ${here} here, ${patch.vertexCount} and ${patch.faceCount} there`);
    }
  }

  /** Whether the patch brings news. */
  private begins(patch: MeshPatch): boolean {
    const isWhole = patch.baseVersion === 0;
    if (patch.part !== (isWhole && patch.part === 0 ? 0 : this.nextPart)) throw new GapError(`part ${patch.part} is out of order`);
    if (isWhole) {
      if (patch.part === 0) this.beginWhole(patch.session);
      else if (this.whole === null || patch.session !== this.session) throw new GapError("a whole state without its beginning");
      return true;
    }
    if (patch.session !== this.session) throw new GapError(`a change of session ${patch.session}, here is ${this.session}`);
    if (patch.baseVersion !== this.version && patch.version <= this.version) return false;
    if (this.whole !== null || patch.baseVersion !== this.version) {
      throw new GapError(`a change from version ${patch.baseVersion}, here is ${this.version}`);
    }
    return true;
  }

  private beginWhole(session: string): void {
    if (session !== this.session) this.clear();
    this.session = session;
    this.whole = { vertices: new Uint8Array(this.positions.length / 3), faces: new Uint8Array(this.corners.length / 3) };
  }

  /** Takes up numbers of vertices that are here. */
  setNumbers({ which, vertices, numbers }: VertexNumbers): void {
    if (which === WHICH.outlier) this.forgetOutliers();
    if (which === WHICH.deviation) this.deviation ??= new Float32Array(this.positions.length / 3).fill(FAR);
    for (let i = 0; i < vertices.length; i++) {
      const vertex = vertices[i];
      if (3 * vertex >= this.positions.length) continue;
      if (which === WHICH.outlier) this.quality[4 * vertex + QUALITY.outlier] = 1;
      else if (this.deviation !== null) this.deviation[vertex] = Number.isNaN(numbers[i]) ? FAR : numbers[i];
      this.dirtyVertices.mark(vertex);
    }
    if (which === WHICH.outlier) this.hasOutliers = vertices.length > 0;
  }

  private forgetOutliers(): void {
    if (!this.hasOutliers) return;
    for (let q = QUALITY.outlier; q < this.quality.length; q += 4) {
      if (this.quality[q] === 0) continue;
      this.quality[q] = 0;
      this.dirtyVertices.mark((q - QUALITY.outlier) / 4);
    }
  }

  private clear(): void {
    for (let face = 0; face < this.faceEnd; face++) this.removeFace(face);
    this.quality.fill(0);
    this.vertexCount = 0;
    this.version = 0;
    this.deviation = null;
    this.hasOutliers = false;
    this.low.fill(Infinity);
    this.high.fill(-Infinity);
  }

  /** Removes everything that a whole state did not name, after its last part. */
  private sweep(): void {
    const whole = this.whole;
    if (whole === null) return;
    this.whole = null;
    for (let face = 0; face < this.faceEnd; face++) if (whole.faces[face] !== 1) this.removeFace(face);
    for (let vertex = 0; vertex < this.positions.length / 3; vertex++) {
      if (whole.vertices[vertex] !== 1) this.removeVertex(vertex);
    }
  }

  private setVertices(patch: MeshPatch): void {
    const { vertices, positions, variance, support } = patch;
    for (let i = 0; i < vertices.length; i++) {
      const vertex = vertices[i];
      for (let axis = 0; axis < 3; axis++) {
        const x = positions[3 * i + axis];
        this.positions[3 * vertex + axis] = x;
        if (x < this.low[axis]) this.low[axis] = x;
        if (x > this.high[axis]) this.high[axis] = x;
      }
      this.variance[vertex] = variance[i] >= 0 ? variance[i] : -1;
      const q = 4 * vertex;
      this.quality[q + QUALITY.support] = support[i];
      this.vertexCount += 1 - this.quality[q + QUALITY.alive];
      this.quality[q + QUALITY.alive] = 1;
      this.dirtyVertices.mark(vertex);
      if (this.whole !== null) this.whole.vertices[vertex] = 1;
    }
  }

  private setFaces(patch: MeshPatch): void {
    const { faces, corners } = patch;
    for (let i = 0; i < faces.length; i++) {
      const face = faces[i];
      const a = corners[3 * i];
      const b = corners[3 * i + 1];
      const c = corners[3 * i + 2];
      if (a === b || b === c || a === c) throw new GapError(`face ${face} uses a vertex twice`);
      if (!this.hasFace(face)) this.faceCount++;
      this.corners[3 * face] = a;
      this.corners[3 * face + 1] = b;
      this.corners[3 * face + 2] = c;
      if (face >= this.faceEnd) this.faceEnd = face + 1;
      this.dirtyFaces.mark(face);
      if (this.whole !== null) this.whole.faces[face] = 1;
    }
  }

  hasFace(face: number): boolean {
    return this.corners[3 * face] !== this.corners[3 * face + 1];
  }

  private removeFace(face: number): void {
    if (face >= this.faceEnd || !this.hasFace(face)) return;
    this.corners.fill(0, 3 * face, 3 * face + 3);
    this.faceCount--;
    this.dirtyFaces.mark(face);
  }

  private removeVertex(vertex: number): void {
    const alive = 4 * vertex + QUALITY.alive;
    if (alive >= this.quality.length || this.quality[alive] === 0) return;
    this.quality[alive] = 0;
    this.vertexCount--;
  }

  /** Makes room for every number that the patch names, and for as many as it says there will be. */
  private reserve(patch: MeshPatch): void {
    const vertices = Math.max(end(patch.vertices), end(patch.corners), Math.min(patch.vertexCount, 1 << 24));
    const faces = Math.max(end(patch.faces), Math.min(patch.faceCount, 1 << 24));
    if (3 * vertices <= this.positions.length && 3 * faces <= this.corners.length) return;
    const vertexRoom = Math.max(Math.ceil(vertices * SPARE), this.positions.length / 3);
    const faceRoom = Math.max(Math.ceil(faces * SPARE), this.corners.length / 3);
    this.positions = grown(this.positions, new Float32Array(3 * vertexRoom));
    this.variance = grown(this.variance, new Float32Array(vertexRoom));
    this.quality = grown(this.quality, new Uint8Array(4 * vertexRoom));
    this.corners = grown(this.corners, new Uint32Array(3 * faceRoom));
    if (this.deviation !== null) this.deviation = grown(this.deviation, new Float32Array(vertexRoom).fill(FAR));
    if (this.whole !== null) {
      this.whole.vertices = grown(this.whole.vertices, new Uint8Array(vertexRoom));
      this.whole.faces = grown(this.whole.faces, new Uint8Array(faceRoom));
    }
    this.dirtyVertices = new DirtyRanges(vertexRoom);
    this.dirtyFaces = new DirtyRanges(faceRoom);
    this.generation++;
  }
}

function end(numbers: Uint32Array): number {
  let largest = -1;
  for (let i = 0; i < numbers.length; i++) if (numbers[i] > largest) largest = numbers[i];
  return largest + 1;
}

function grown<T extends Float32Array | Uint32Array | Uint8Array>(from: T, to: T): T {
  to.set(from);
  return to;
}
