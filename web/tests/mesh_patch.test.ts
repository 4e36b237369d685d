/** The decoder reads the bytes of an independent writer, without copies; anything else is one clear error. */
import { describe, expect, it } from "vitest";
import { CdrError } from "../src/cdr";
import { decodeMeshPatch } from "../src/mesh_patch";
import { encode, patch } from "./cdr_writer";

const triangle = patch({
  session: "bench", version: 2 ** 33 + 7, baseVersion: 0, part: 1, partCount: 3, removedFaces: Uint32Array.of(9, 4),
  vertices: Uint32Array.of(3, 1, 2), positions: Float32Array.of(1, 2, 3, -4, 5.5, 6, 7, 8, 9), variance: Float32Array.of(1e-10, NaN, 0),
  support: Uint8Array.of(0, 1, 3), faces: Uint32Array.of(5), corners: Uint32Array.of(1, 2, 3), removedVertices: Uint32Array.of(8),
  vertexCount: 3, faceCount: 1,
});

describe("a mesh patch", () => {
  it("reads as it was written", () => {
    expect(decodeMeshPatch(encode(triangle))).toEqual(triangle);
  });

  it("reads at every alignment of what lies before its numbers", () => {
    for (let length = 0; length < 9; length++) {
      const session = "x".repeat(length);
      expect(decodeMeshPatch(encode({ ...triangle, session }, "f".repeat(length)))).toEqual({ ...triangle, session });
    }
  });

  it("is not copied", () => {
    const frame = encode(triangle);
    expect(decodeMeshPatch(frame).positions.buffer).toBe(frame);
  });

  it("reads known bytes: an empty change from 1 to 2", () => {
    const bytes = [
      1, 0, 0, 0, 0, 1, 0, 0, // kind, encapsulation
      0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, // stamp, empty frame of reference, padding
      2, 0, 0, 0, 97, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, // "a", version after 8 bytes
      1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, // base version, part 0 of 1
      ...new Array<number>(8 * 4).fill(0), 6, 0, 0, 0, 7, 0, 0, 0, // eight empty lists, counts
    ];
    const found = decodeMeshPatch(new Uint8Array(bytes).buffer);
    expect(found).toEqual(patch({ session: "a", version: 2, baseVersion: 1, vertexCount: 6, faceCount: 7 }));
  });

  it("cut off anywhere is refused, never read beyond", () => {
    const frame = encode(triangle);
    for (let length = 0; length < frame.byteLength; length++) {
      expect(() => decodeMeshPatch(frame.slice(0, length))).toThrow(CdrError);
    }
  });

  it.each([
    ["another kind", (bytes: Uint8Array) => (bytes[0] = 2)],
    ["big endian", (bytes: Uint8Array) => (bytes[5] = 0)],
    ["a string longer than the frame", (bytes: Uint8Array) => bytes.fill(255, 16, 20)],
  ])("%s is refused", (_, spoil) => {
    const bytes = new Uint8Array(encode(triangle));
    spoil(bytes);
    expect(() => decodeMeshPatch(bytes.buffer)).toThrow(CdrError);
  });

  it("with numbers that do not belong together is refused", () => {
    expect(() => decodeMeshPatch(encode({ ...triangle, support: Uint8Array.of(1) }))).toThrow(/support: 1 numbers where 3 belong/);
    expect(() => decodeMeshPatch(encode({ ...triangle, corners: Uint32Array.of(1, 2, 4e9) }))).toThrow(/corners: 4000000000/);
    expect(() => decodeMeshPatch(encode({ ...triangle, part: 3 }))).toThrow(/part 3 of 3/);
  });
});
