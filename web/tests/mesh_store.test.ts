/** The store against a naive model (maps by number) under random edits; it reports gaps; the dirty stretches cover the changes. */
import { describe, expect, it } from "vitest";
import type { MeshPatch } from "../src/mesh_patch";
import { GapError, MeshStore, QUALITY } from "../src/mesh_store";
import { pick } from "../src/pick";
import { patch, random } from "./cdr_writer";

/** A mesh as maps, edited at random the way the node does it. */
class Model {
  vertices = new Map<number, { at: number[]; variance: number; support: number }>();
  faces = new Map<number, number[]>();
  version = 0;

  constructor(private readonly next: () => number) {}

  private below(count: number): number {
    return Math.floor(this.next() * count);
  }

  edit(largest: number): MeshPatch {
    const removedFaces = [...this.faces.keys()].filter(() => this.next() < 0.1);
    for (const face of removedFaces) this.faces.delete(face);
    const set = [...new Set(Array.from({ length: 1 + this.below(20) }, () => this.below(largest)))];
    for (const id of set) {
      const at = [this.next(), this.next(), this.next()].map(Math.fround);
      this.vertices.set(id, { at, variance: this.next() < 0.2 ? NaN : Math.fround(this.next()), support: this.below(4) });
    }
    const faces: number[] = [];
    const known = [...this.vertices.keys()];
    for (let i = this.below(15); i > 0 && known.length > 5; i--) {
      const corners = [...new Set([0, 1, 2].map(() => known[this.below(known.length)]))];
      const face = this.below(largest);
      if (corners.length < 3 || faces.includes(face)) continue;
      this.faces.set(face, corners);
      faces.push(face);
    }
    const used = new Set([...this.faces.values()].flat());
    const removed = known.filter((id) => !used.has(id) && this.next() < 0.3);
    for (const id of removed) this.vertices.delete(id);
    const base = this.version++;
    return this.message(base, removedFaces, set.filter((id) => !removed.includes(id)), faces, removed);
  }

  message(baseVersion: number, removedFaces: number[], vertices: number[], faces: number[], removed: number[]): MeshPatch {
    const of = vertices.map((id) => this.vertices.get(id)!);
    return patch({
      version: this.version, baseVersion, removedFaces: Uint32Array.from(removedFaces), vertices: Uint32Array.from(vertices),
      positions: Float32Array.from(of.flatMap(({ at }) => at)), variance: Float32Array.from(of.map(({ variance }) => variance)),
      support: Uint8Array.from(of.map(({ support }) => support)), faces: Uint32Array.from(faces),
      corners: Uint32Array.from(faces.flatMap((face) => this.faces.get(face)!)), removedVertices: Uint32Array.from(removed),
      vertexCount: this.vertices.size, faceCount: this.faces.size,
    });
  }

  whole(): MeshPatch {
    return this.message(0, [], [...this.vertices.keys()], [...this.faces.keys()], []);
  }
}

function expectSame(store: MeshStore, model: Model): void {
  expect([store.vertexCount, store.faceCount, store.version]).toEqual([model.vertices.size, model.faces.size, model.version]);
  for (const [id, { at, variance, support }] of model.vertices) {
    expect([...store.positions.subarray(3 * id, 3 * id + 3)]).toEqual(at);
    expect(store.variance[id]).toBe(Number.isNaN(variance) ? -1 : variance);
    expect(store.quality[4 * id + QUALITY.support]).toBe(support);
  }
  const faces = new Map<number, number[]>();
  for (let face = 0; face < store.faceEnd; face++) {
    if (store.hasFace(face)) faces.set(face, [...store.corners.subarray(3 * face, 3 * face + 3)]);
  }
  expect(faces).toEqual(new Map([...model.faces].sort(([a], [b]) => a - b)));
}

describe("the store", () => {
  it.each([1, 2, 3, 4, 5])("follows random edits (seed %i)", (seed) => {
    const model = new Model(random(seed));
    const store = new MeshStore();
    for (let edit = 0; edit < 120; edit++) {
      store.apply(model.edit(10 + 5 * edit));
      expectSame(store, model);
    }
    // and a late whole state, over the rest of another version
    for (let edit = 0; edit < 10; edit++) model.edit(600);
    store.apply(model.whole());
    expectSame(store, model);
  });

  it("marks all that changed, in few stretches", () => {
    const model = new Model(random(7));
    const store = new MeshStore();
    store.apply(model.edit(50_000));
    for (let edit = 0; edit < 40; edit++) {
      const change = model.edit(50_000);
      store.apply(change);
      if (store.dirtyVertices.isEmpty) continue;
      const ranges = store.dirtyVertices.take(4);
      expect(ranges.length).toBeLessThanOrEqual(4);
      for (const id of change.vertices) {
        expect(ranges.some(({ start, count }) => id >= start && id < start + count)).toBe(true);
      }
    }
  });

  it("tells a gap, a part out of order, and counts that do not come out", () => {
    const store = new MeshStore();
    const vertices = { vertices: Uint32Array.of(0), positions: new Float32Array(3), variance: new Float32Array(1), support: new Uint8Array(1) };
    store.apply(patch({ version: 5, ...vertices, vertexCount: 1 }));
    expect(() => store.apply(patch({ version: 8, baseVersion: 6 }))).toThrow(GapError);
    expect(() => store.apply(patch({ version: 6, baseVersion: 5, session: "other" }))).toThrow(GapError);
    expect(() => store.apply(patch({ version: 6, baseVersion: 5, part: 1, partCount: 2 }))).toThrow(GapError);
    expect(() => store.apply(patch({ version: 6, baseVersion: 5, vertexCount: 2 }))).toThrow(/1 vertices/);
  });

  it("passes over what it has", () => {
    const store = new MeshStore();
    store.apply(patch({ version: 5 }));
    store.apply(patch({ version: 5, baseVersion: 4, vertexCount: 9 }));
    expect(store.version).toBe(5);
  });
});

describe("a ray", () => {
  it("meets the nearer of two faces, from either side, and none beside them", () => {
    const square = (z: number): number[] => [0, 0, z, 1, 0, z, 0, 1, z];
    const store = new MeshStore();
    store.apply(
      patch({
        vertices: Uint32Array.of(0, 1, 2, 3, 4, 5), positions: Float32Array.from([...square(0), ...square(2)]),
        variance: new Float32Array(6), support: new Uint8Array(6), faces: Uint32Array.of(0, 1),
        corners: Uint32Array.of(0, 1, 2, 3, 5, 4), vertexCount: 6, faceCount: 2,
      }),
    );
    expect(pick(store, [0.25, 0.25, 5], [0, 0, -1])).toEqual({ face: 1, distance: 3, point: [0.25, 0.25, 2] });
    expect(pick(store, [0.25, 0.25, -5], [0, 0, 1])?.face).toBe(0);
    expect(pick(store, [0.8, 0.8, 5], [0, 0, -1])).toBeNull();
  });
});
