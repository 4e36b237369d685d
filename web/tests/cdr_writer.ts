/**
 * Writes a MeshPatch as DDS does, straight from the rules of CDR and independent of the reader: the other way that tests compare
 * with.
 */
import type { MeshPatch } from "../src/mesh_patch";

export class CdrWriter {
  private readonly bytes: number[] = [1, 0, 0, 0, 0x00, 0x01, 0x00, 0x00];

  private pad(size: number): void {
    while ((this.bytes.length - 8) % size !== 0) this.bytes.push(0);
  }

  u8(number: number): void {
    this.bytes.push(number & 0xff);
  }

  u32(number: number): void {
    this.pad(4);
    for (let byte = 0; byte < 4; byte++) this.bytes.push((number / 2 ** (8 * byte)) & 0xff);
  }

  u64(number: number): void {
    this.pad(8);
    this.u32(number % 2 ** 32);
    this.u32(Math.floor(number / 2 ** 32));
  }

  f32(number: number): void {
    const view = new DataView(new ArrayBuffer(4));
    view.setFloat32(0, number);
    this.u32(view.getUint32(0));
  }

  string(words: string): void {
    const utf8 = new TextEncoder().encode(words);
    this.u32(utf8.length + 1);
    this.bytes.push(...utf8, 0);
  }

  sequence(numbers: Iterable<number>, write: (number: number) => void): void {
    const all = [...numbers];
    this.u32(all.length);
    for (const number of all) write.call(this, number);
  }

  frame(): ArrayBuffer {
    return new Uint8Array(this.bytes).buffer;
  }
}

/** A patch that changes only the given fields. */
export function patch(given: Partial<MeshPatch>): MeshPatch {
  return {
    session: "s", version: 1, baseVersion: 0, part: 0, partCount: 1, removedFaces: new Uint32Array(), vertices: new Uint32Array(),
    positions: new Float32Array(), variance: new Float32Array(), support: new Uint8Array(), faces: new Uint32Array(),
    corners: new Uint32Array(), removedVertices: new Uint32Array(), vertexCount: 0, faceCount: 0, ...given,
  };
}

export function encode(patch: MeshPatch, frameId = "object"): ArrayBuffer {
  const writer = new CdrWriter();
  writer.u32(1_700_000_000);
  writer.u32(5);
  writer.string(frameId);
  writer.string(patch.session);
  writer.u64(patch.version);
  writer.u64(patch.baseVersion);
  writer.u32(patch.part);
  writer.u32(patch.partCount);
  writer.sequence(patch.removedFaces, writer.u32);
  writer.sequence(patch.vertices, writer.u32);
  writer.sequence(patch.positions, writer.f32);
  writer.sequence(patch.variance, writer.f32);
  writer.sequence(patch.support, writer.u8);
  writer.sequence(patch.faces, writer.u32);
  writer.sequence(patch.corners, writer.u32);
  writer.sequence(patch.removedVertices, writer.u32);
  writer.u32(patch.vertexCount);
  writer.u32(patch.faceCount);
  return writer.frame();
}

/** Numbers that look random and are the same each time (mulberry32). */
export function random(seed: number): () => number {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let mixed = Math.imul(state ^ (state >>> 15), state | 1);
    mixed ^= mixed + Math.imul(mixed ^ (mixed >>> 7), mixed | 61);
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
  };
}
