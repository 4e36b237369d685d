/**
 * A change of the mesh as it comes over the wire: `touchup_msgs/msg/MeshPatch` behind one kind byte.
 *
 * Its arrays are views into the frame. A decoded patch is whole and consistent in itself (lengths belong together, no number is absurd);
 * the store decides whether it fits its mesh.
 */
import { CdrError, CdrReader } from "./cdr";

export const KIND_MESH_PATCH = 1;

/** Support of a vertex, as `MeshPatch.SUPPORT_*`. */
export const Support = { scan: 0, touched: 1, guessed: 2, unreachable: 3 } as const;

/** Numbers of vertices and faces stay below this; more would not fit into the memory of a tablet. */
export const MOST_IDS = 1 << 24;

export interface MeshPatch {
  session: string;
  /** State of the mesh that this leads to, and the one that it leads from; from 0: a part of the whole state. */
  version: number;
  baseVersion: number;
  part: number;
  partCount: number;
  removedFaces: Uint32Array;
  vertices: Uint32Array;
  /** Three numbers for each vertex, m. */
  positions: Float32Array;
  /** Along the normal, m²; NaN if unknown. */
  variance: Float32Array;
  support: Uint8Array;
  faces: Uint32Array;
  /** Three numbers of vertices for each face. */
  corners: Uint32Array;
  removedVertices: Uint32Array;
  /** Of the mesh in `version`. */
  vertexCount: number;
  faceCount: number;
}

/**
 * @param frame the whole frame of the WebSocket: kind, three zero bytes, encapsulation, body.
 * @throws CdrError when it is not a mesh patch.
 */
export function decodeMeshPatch(frame: ArrayBuffer): MeshPatch {
  if (frame.byteLength < 8 || new Uint8Array(frame, 0, 1)[0] !== KIND_MESH_PATCH) {
    throw new CdrError("not a mesh patch: the first byte says so");
  }
  const reader = new CdrReader(frame, 4);
  reader.int32(); // stamp, s
  reader.uint32(); // and ns
  reader.string(); // frame of reference: always that of the part here
  const session = reader.string();
  const version = reader.uint64();
  const baseVersion = reader.uint64();
  const part = reader.uint32();
  const partCount = reader.uint32();
  const removedFaces = ids(reader, "removed_faces");
  const vertices = ids(reader, "vertices");
  const positions = reader.float32s("positions", 3 * vertices.length);
  const variance = reader.float32s("variance", vertices.length);
  const support = reader.uint8s("support", vertices.length);
  const faces = ids(reader, "faces");
  const corners = reader.uint32s("corners", 3 * faces.length);
  const removedVertices = ids(reader, "removed_vertices");
  const vertexCount = reader.uint32();
  const faceCount = reader.uint32();
  if (part >= partCount) throw new CdrError(`part ${part} of ${partCount}`);
  if (reader.left > 7) throw new CdrError(`${reader.left} bytes too many`);
  below(corners, "corners");
  return {
    session, version, baseVersion, part, partCount, removedFaces, vertices, positions, variance, support, faces, corners,
    removedVertices, vertexCount, faceCount,
  };
}

function ids(reader: CdrReader, what: string): Uint32Array {
  const found = reader.uint32s(what);
  below(found, what);
  return found;
}

function below(numbers: Uint32Array, what: string): void {
  for (let i = 0; i < numbers.length; i++) {
    if (numbers[i] >= MOST_IDS) throw new CdrError(`${what}: ${numbers[i]} is not a number of the mesh`);
  }
}
