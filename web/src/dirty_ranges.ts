/**
 * Stretches of an array that changed since their last upload to the GPU.
 *
 * Blocks make marking cost one store; near stretches merge until few remain, for each is a call of its own to the driver.
 */

/** Elements in a block: 12 kB of positions, below which a call costs more than its bytes. */
const BLOCK = 1024;

export interface Range {
  /** First element. */
  start: number;
  count: number;
}

export class DirtyRanges {
  private blocks: Uint8Array;
  private first = Infinity;
  private last = -1;

  constructor(private length: number) {
    this.blocks = new Uint8Array(Math.ceil(length / BLOCK));
  }

  mark(element: number): void {
    const block = (element / BLOCK) | 0;
    this.blocks[block] = 1;
    if (block < this.first) this.first = block;
    if (block > this.last) this.last = block;
  }

  get isEmpty(): boolean {
    return this.last < 0;
  }

  /** The changed stretches in order, at most `most` of them; none is dirty afterwards. */
  take(most: number): Range[] {
    const ranges: Range[] = [];
    for (let block = this.first; block <= this.last; block++) {
      if (this.blocks[block] === 0) continue;
      this.blocks[block] = 0;
      const start = block * BLOCK;
      const previous = ranges.at(-1);
      if (previous !== undefined && previous.start + previous.count === start) previous.count += BLOCK;
      else ranges.push({ start, count: BLOCK });
    }
    this.first = Infinity;
    this.last = -1;
    joinNearest(ranges, most);
    const end = ranges.at(-1);
    if (end !== undefined) end.count = Math.min(end.count, this.length - end.start);
    return ranges;
  }
}

/** Joins the ranges with the smallest gaps between them until at most `most` remain. */
function joinNearest(ranges: Range[], most: number): void {
  const excess = ranges.length - most;
  if (excess <= 0) return;
  const gap = (i: number): number => ranges[i].start - (ranges[i - 1].start + ranges[i - 1].count);
  const byGap = Array.from({ length: ranges.length - 1 }, (_, i) => i + 1).sort((a, b) => gap(a) - gap(b));
  const joined = new Set(byGap.slice(0, excess));
  let kept = 0;
  for (let i = 1; i < ranges.length; i++) {
    if (joined.has(i)) ranges[kept].count = ranges[i].start + ranges[i].count - ranges[kept].start;
    else ranges[++kept] = ranges[i];
  }
  ranges.length = kept + 1;
}
