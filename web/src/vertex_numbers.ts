/** A number for each of some vertices, beside the mesh: values for its colours that no patch has. */
import { CdrError } from "./cdr";

/** First byte of such a frame. */
const KIND = 2;
/** Bytes before the numbers of the vertices. */
const HEAD = 8;

/** The second byte: which number. */
export const WHICH = {
  /** From the nominal part, m; NaN far from it. */
  deviation: 1,
  /** 1 near a rejected contact; unnamed vertices have none. */
  outlier: 3,
} as const;

export interface VertexNumbers {
  which: number;
  vertices: Uint32Array;
  numbers: Float32Array;
}

export function isVertexNumbers(frame: ArrayBuffer): boolean {
  return frame.byteLength > 0 && new Uint8Array(frame, 0, 1)[0] === KIND;
}

/**
 * Vertices and their numbers, as views into the frame.
 *
 * @throws CdrError when the frame is none of these.
 */
export function decodeVertexNumbers(frame: ArrayBuffer): VertexNumbers {
  if (frame.byteLength < HEAD) throw new CdrError(`${frame.byteLength} bytes are too few`);
  const view = new DataView(frame);
  const which = view.getUint8(1);
  const count = view.getUint32(4, true);
  if (!Object.values<number>(WHICH).includes(which)) throw new CdrError(`number ${which} of vertices is not known here`);
  if (frame.byteLength !== HEAD + 8 * count) throw new CdrError(`${frame.byteLength} bytes are not those of ${count} vertices`);
  return { which, vertices: new Uint32Array(frame, HEAD, count), numbers: new Float32Array(frame, HEAD + 4 * count, count) };
}
