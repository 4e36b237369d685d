/**
 * For tests only: `window.touchup` has the values that a test needs to compare the picture with rays cast onto the saved mesh, and the
 * times of frames. The page does not use it, and it changes nothing.
 */
import type { MeshStore } from "./mesh_store";
import type { Picture } from "./picture";

export interface TestHook {
  session(): string;
  version(): number;
  vertexCount(): number;
  faceCount(): number;
  /** Column-major matrices; places of the part in m go by projection · view to -1..1, y up. */
  camera(): { view: number[]; projection: number[]; width: number; height: number; pixelRatio: number };
  /** Resolves after all requested drawing. */
  idle(): Promise<void>;
  /** Of the main thread for each of the last frames, ms. */
  frameTimes(): number[];
  /** When the whole mesh was in the picture for the first time, ms since the page began to load; null before. */
  firstPicture(): number | null;
  /** Face and place (m) under a place of the picture, px from its upper left. */
  pick(x: number, y: number): { face: number; point: number[] } | null;
  /** Bytes r g b a of one place of the picture, drawn anew. */
  pixel(x: number, y: number): number[];
  tip(): number[] | null;
}

declare global {
  interface Window {
    touchup?: TestHook;
  }
}

export function installTestHook(store: MeshStore, picture: Picture): void {
  const { stage } = picture;
  let first: number | null = null;
  stage.afterFrame.push(() => {
    if (first === null && store.version > 0) first = performance.now();
  });
  window.touchup = {
    session: () => store.session,
    version: () => store.version,
    vertexCount: () => store.vertexCount,
    faceCount: () => store.faceCount,
    camera: () => {
      stage.camera.updateMatrixWorld();
      return {
        view: stage.camera.matrixWorldInverse.toArray(),
        projection: stage.camera.projectionMatrix.toArray(),
        pixelRatio: stage.renderer.getPixelRatio(),
        ...stage.size,
      };
    },
    idle: () => stage.idle(),
    frameTimes: () => [...stage.frameTimes],
    firstPicture: () => first,
    pick: (x, y) => {
      const hit = picture.pickAt(x, y);
      return hit === null ? null : { face: hit.face, point: hit.point };
    },
    pixel: (x, y) => stage.pixel(x, y),
    tip: () => picture.tip.state.place?.toArray() ?? null,
  };
}
