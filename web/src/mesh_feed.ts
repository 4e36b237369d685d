/**
 * Takes the frames of the mesh off the line, in their order, into the store. An invalid frame, or one that does not continue the mesh,
 * restarts the line, which brings the whole state.
 */
import { CdrError } from "./cdr";
import type { Connection } from "./connection";
import { decodeMeshPatch } from "./mesh_patch";
import { decodeVertexNumbers, isVertexNumbers } from "./vertex_numbers";
import { GapError, type MeshStore } from "./mesh_store";

export interface FeedListeners {
  /** After each patch. */
  onChange: () => void;
  /** The first part of a mesh of another session came. */
  onOther: () => void;
  /** The line begins anew. */
  onGap: () => void;
}

export function feedMesh(connection: Connection, store: MeshStore, { onChange, onOther, onGap }: FeedListeners): void {
  connection.onBytes = (frame) => {
    const { session } = store;
    try {
      if (isVertexNumbers(frame)) store.setNumbers(decodeVertexNumbers(frame));
      else store.apply(decodeMeshPatch(frame));
    } catch (error) {
      if (!(error instanceof CdrError || error instanceof GapError)) throw error;
      console.warn(`mesh: ${error.message}`);
      onGap();
      connection.renew();
      return;
    }
    if (store.session !== session) onOther();
    onChange();
  };
}
