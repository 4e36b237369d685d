/** The removable touch: the one behind a place of the part, as the node finds it; the page drops answers to an earlier question. */
import type { MeshStore } from "./mesh_store";
import { QUALITY } from "./mesh_store";
import type { Answer, Xyz } from "./messages";

/** A stamp, as ROS has it. */
export interface Stamp {
  sec: number;
  nanosec: number;
}

/** Answer of `~/take_out_touch`. */
export interface FoundTouch extends Answer {
  /** Names it. */
  touch: Stamp;
  contacts: number;
  /** Some of its contacts in order of time, m. */
  points: Xyz[];
}

export type Place = readonly [number, number, number];
type Ask = (request: object) => Promise<FoundTouch>;

/** `support` of a touched vertex. */
const TOUCHED = 1;

/** Whether a touch supports a face, by one of its corners. */
export function isTouched(store: MeshStore, face: number): boolean {
  const corners = store.corners.subarray(3 * face, 3 * face + 3);
  return corners.some((vertex) => store.quality[4 * vertex + QUALITY.support] === TOUCHED);
}

export class TouchChoice {
  chosen: FoundTouch | null = null;
  private questions = 0;

  constructor(
    private readonly ask: Ask,
    private readonly onChange: () => void,
  ) {}

  /** Looks for the touch at a place of the part, m; there is no choice until the answer. */
  async look([x, y, z]: Place, frame: string): Promise<void> {
    this.forget();
    const question = this.questions;
    const found = await this.ask({ point: { header: { frame_id: frame }, point: { x, y, z } }, preview: true });
    if (question !== this.questions || !found.success) return;
    this.chosen = found;
    this.onChange();
  }

  forget(): void {
    this.questions++;
    if (this.chosen === null) return;
    this.chosen = null;
    this.onChange();
  }
}

export function takeOutRequest({ touch }: FoundTouch): object {
  return { touch };
}

export function putBackRequest({ touch }: FoundTouch): object {
  return { touch, put_back: true };
}
