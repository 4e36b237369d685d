/**
 * Reads the encoding of DDS: plain CDR (XCDR1), little endian.
 *
 * Numbers lie at multiples of their own size, counted from the first byte after the encapsulation; if the buffer aligns that byte to 8,
 * arrays of numbers are views into it without a copy.
 */

/** The bytes are no valid encoding; the message names the place and the reason. For the log, not for the operator. */
export class CdrError extends Error {}

/** Name of little endian CDR in the four bytes before the body. */
const ENCAPSULATION = 0x0001;
/** Bytes of the encapsulation. */
const HEAD = 4;

export class CdrReader {
  private readonly view: DataView;
  /** First byte of the body in the buffer. */
  private readonly origin: number;
  private at: number;

  /** @param start offset of the encapsulation; the buffer has to align the body after it to 8. */
  constructor(
    private readonly buffer: ArrayBuffer,
    start: number,
  ) {
    this.origin = start + HEAD;
    this.at = this.origin;
    this.view = new DataView(buffer);
    if (buffer.byteLength < this.origin) throw new CdrError(`${buffer.byteLength} bytes are too few`);
    if (this.origin % 8 !== 0) throw new CdrError(`the body begins at byte ${this.origin}, which is not 8-aligned`);
    const encapsulation = this.view.getUint16(start);
    if (encapsulation !== ENCAPSULATION) throw new CdrError(`encapsulation ${encapsulation} is not little endian CDR`);
  }

  int32(): number {
    return this.view.getInt32(this.take(4, 4), true);
  }

  uint32(): number {
    return this.view.getUint32(this.take(4, 4), true);
  }

  /** Exact up to 2^53, which no count here comes near. */
  uint64(): number {
    return Number(this.view.getBigUint64(this.take(8, 8), true));
  }

  string(): string {
    const length = this.uint32();
    const start = this.take(length, 1);
    if (length === 0 || this.view.getUint8(start + length - 1) !== 0) throw new CdrError("a string has no end");
    return new TextDecoder().decode(new Uint8Array(this.buffer, start, length - 1));
  }

  uint8s(what: string, expected?: number): Uint8Array {
    const count = this.count(what, expected);
    return new Uint8Array(this.buffer, this.take(count, 1), count);
  }

  uint32s(what: string, expected?: number): Uint32Array {
    const count = this.count(what, expected);
    return count === 0 ? new Uint32Array(0) : new Uint32Array(this.buffer, this.take(4 * count, 4), count);
  }

  float32s(what: string, expected?: number): Float32Array {
    const count = this.count(what, expected);
    return count === 0 ? new Float32Array(0) : new Float32Array(this.buffer, this.take(4 * count, 4), count);
  }

  /** Bytes that were not read: up to seven may pad the end. */
  get left(): number {
    return this.buffer.byteLength - this.at;
  }

  private count(what: string, expected: number | undefined): number {
    const count = this.uint32();
    if (expected !== undefined && count !== expected) throw new CdrError(`${what}: ${count} numbers where ${expected} belong`);
    return count;
  }

  private take(bytes: number, alignment: number): number {
    const start = this.at + ((alignment - ((this.at - this.origin) % alignment)) % alignment);
    if (start + bytes > this.buffer.byteLength) {
      throw new CdrError(`${bytes} bytes at ${start} reach over the end at ${this.buffer.byteLength}`);
    }
    this.at = start + bytes;
    return start;
  }
}
