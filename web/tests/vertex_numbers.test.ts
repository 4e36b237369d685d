import { describe, expect, it } from "vitest";
import { CdrError } from "../src/cdr";
import { FAR, MeshStore, QUALITY } from "../src/mesh_store";
import { decodeVertexNumbers, isVertexNumbers } from "../src/vertex_numbers";

/** Written byte by byte, as in the description of the frame. */
function frame(vertices: number[], numbers: number[], kind = 2, which = 1): ArrayBuffer {
  const bytes = new ArrayBuffer(8 + 8 * vertices.length);
  const view = new DataView(bytes);
  view.setUint8(0, kind);
  view.setUint8(1, which);
  view.setUint32(4, vertices.length, true);
  vertices.forEach((vertex, i) => view.setUint32(8 + 4 * i, vertex, true));
  numbers.forEach((number, i) => view.setFloat32(8 + 4 * vertices.length + 4 * i, number, true));
  return bytes;
}

describe("numbers of vertices", () => {
  it("come with the numbers of their vertices", () => {
    const bytes = frame([3, 900], [0.5, -0.25]);
    expect(isVertexNumbers(bytes)).toBe(true);
    const { which, vertices, numbers } = decodeVertexNumbers(bytes);
    expect(which).toBe(1);
    expect([...vertices]).toEqual([3, 900]);
    expect([...numbers]).toEqual([0.5, -0.25]);
  });

  it("are refused where the frame is cut off, longer, or of another number", () => {
    expect(isVertexNumbers(frame([1], [1], 1))).toBe(false);
    expect(() => decodeVertexNumbers(frame([1], [1]).slice(0, 12))).toThrow(CdrError);
    expect(() => decodeVertexNumbers(new ArrayBuffer(4))).toThrow(CdrError);
    expect(() => decodeVertexNumbers(frame([1], [1], 2, 9))).toThrow(CdrError);
  });

  it("are kept for vertices that are there, and far where nobody measured them", () => {
    const store = new MeshStore();
    store.positions = new Float32Array(9);
    store.setNumbers(decodeVertexNumbers(frame([0, 1, 77], [0.001, Number.NaN, 1])));
    expect([...(store.deviation ?? [])]).toEqual([Math.fround(0.001), FAR, FAR]);
  });

  it("are marks where contacts were rejected", () => {
    const store = new MeshStore();
    store.positions = new Float32Array(9);
    store.quality = new Uint8Array(12);
    const marks = () => [0, 1, 2].map((vertex) => store.quality[4 * vertex + QUALITY.outlier]);
    store.setNumbers(decodeVertexNumbers(frame([0, 1], [1, 1], 2, 3)));
    expect([marks(), store.hasOutliers]).toEqual([[1, 1, 0], true]);
    store.setNumbers(decodeVertexNumbers(frame([2], [1], 2, 3)));
    expect(marks()).toEqual([0, 0, 1]);
    store.setNumbers(decodeVertexNumbers(frame([], [], 2, 3)));
    expect([marks(), store.hasOutliers]).toEqual([[0, 0, 0], false]);
  });
});
