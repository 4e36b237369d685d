/**
 * The first face on a ray.
 *
 * By going through all of them: some 10 ms for a million faces, for one tap now and then; a tree would need an update with every touch.
 */
import type { MeshStore } from "./mesh_store";

export interface Hit {
  face: number;
  /** m. */
  point: [number, number, number];
  /** Along the ray, in lengths of its direction. */
  distance: number;
}

type Triple = readonly [number, number, number];

/** A ray so parallel to a face that their crossing has no place, relative. */
const PARALLEL = 1e-14;

/** After Möller and Trumbore; faces count from both sides. */
export function pick(store: MeshStore, origin: Triple, direction: Triple): Hit | null {
  const { positions: p, corners } = store;
  const [ox, oy, oz] = origin;
  const [dx, dy, dz] = direction;
  let nearest = Infinity;
  let face = -1;
  for (let i = 0; i < 3 * store.faceEnd; i += 3) {
    const a = 3 * corners[i];
    const b = 3 * corners[i + 1];
    const c = 3 * corners[i + 2];
    if (a === b) continue;
    const ax = p[a], ay = p[a + 1], az = p[a + 2];
    const ux = p[b] - ax, uy = p[b + 1] - ay, uz = p[b + 2] - az;
    const vx = p[c] - ax, vy = p[c + 1] - ay, vz = p[c + 2] - az;
    const hx = dy * vz - dz * vy, hy = dz * vx - dx * vz, hz = dx * vy - dy * vx;
    const det = ux * hx + uy * hy + uz * hz;
    if (Math.abs(det) < PARALLEL) continue;
    const sx = ox - ax, sy = oy - ay, sz = oz - az;
    const u = (sx * hx + sy * hy + sz * hz) / det;
    if (u < 0 || u > 1) continue;
    const qx = sy * uz - sz * uy, qy = sz * ux - sx * uz, qz = sx * uy - sy * ux;
    const v = (dx * qx + dy * qy + dz * qz) / det;
    if (v < 0 || u + v > 1) continue;
    const t = (vx * qx + vy * qy + vz * qz) / det;
    if (t > 0 && t < nearest) {
      nearest = t;
      face = i / 3;
    }
  }
  if (face < 0) return null;
  return { face, distance: nearest, point: [ox + nearest * dx, oy + nearest * dy, oz + nearest * dz] };
}
