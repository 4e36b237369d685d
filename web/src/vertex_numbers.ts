/** A number for each of some vertices, beside the mesh: how far they are from the nominal part. */
import { CdrError } from "./cdr";

/** First byte of such a frame, and the second of one with deviations, m. */
const KIND = 2;
const DEVIATION = 1;
/** Bytes before the numbers of the vertices. */
const HEAD = 8;

export function isVertexNumbers(frame: ArrayBuffer): boolean {
  return frame.byteLength > 0 && new Uint8Array(frame, 0, 1)[0] === KIND;
}

/**
 * Vertices and their deviations, m, as views into the frame; NaN where the nominal part is far.
 *
 * @throws CdrError when the frame is none of these.
 */
export function decodeDeviations(frame: ArrayBuffer): [vertices: Uint32Array, deviations: Float32Array] {
  if (frame.byteLength < HEAD) throw new CdrError(`${frame.byteLength} bytes are too few`);
  const view = new DataView(frame);
  const count = view.getUint32(4, true);
  if (view.getUint8(1) !== DEVIATION) throw new CdrError(`number ${view.getUint8(1)} of vertices is not known here`);
  if (frame.byteLength !== HEAD + 8 * count) throw new CdrError(`${frame.byteLength} bytes are not those of ${count} vertices`);
  return [new Uint32Array(frame, HEAD, count), new Float32Array(frame, HEAD + 4 * count, count)];
}
