/**
 * The line to the node: one WebSocket, which comes back by itself, with topics coming in, calls going out, and bytes of the mesh.
 *
 * A line with a silence of 10 s counts as lost. After a loss it tries again in 1, 2, 4, then every 8 s.
 */
import type { TopicName, Topics } from "./messages";

export const SUBPROTOCOL = "touchup.v1";
/** Silence that counts as a lost line, ms. */
export const SILENCE = 10_000;
/** Waits before the next try, ms; the last one repeats. */
export const WAITS = [1000, 2000, 4000, 8000];
/** Time without an answer after which a call has failed, ms. */
const ANSWER_WITHIN = 15_000;

export type LineState = { kind: "connecting" } | { kind: "connected" } | { kind: "waiting"; seconds: number } | { kind: "ended" };

/** Reason of a failed call; `sentence` is the node's own, null if it gave none. */
export class CallError extends Error {
  constructor(
    readonly reason: "refused" | "lost" | "late",
    readonly sentence: string | null = null,
  ) {
    super(sentence ?? reason);
  }
}

interface Waiting {
  resolve: (response: unknown) => void;
  reject: (error: CallError) => void;
  timer: ReturnType<typeof setTimeout>;
}

export class Connection {
  state: LineState = { kind: "connecting" };
  private socket: WebSocket | null = null;
  private tries = 0;
  private nextId = 1;
  private readonly calls = new Map<number, Waiting>();
  private readonly topics = new Map<string, Array<(message: never) => void>>();
  private readonly stateListeners: Array<(state: LineState) => void> = [];
  private silence: ReturnType<typeof setTimeout> | undefined;
  private countdown: ReturnType<typeof setInterval> | undefined;
  /** Takes the binary frames. */
  onBytes: (frame: ArrayBuffer) => void = () => {};

  constructor(
    private readonly address: string,
    private readonly open: (address: string) => WebSocket = (address) => new WebSocket(address, SUBPROTOCOL),
  ) {}

  on<T extends TopicName>(topic: T, listener: (message: Topics[T]) => void): void {
    const listeners = this.topics.get(topic) ?? [];
    listeners.push(listener as (message: never) => void);
    this.topics.set(topic, listeners);
  }

  onState(listener: (state: LineState) => void): void {
    this.stateListeners.push(listener);
    listener(this.state);
  }

  connect(): void {
    clearInterval(this.countdown);
    this.drop();
    this.change({ kind: "connecting" });
    const socket = this.open(this.address);
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => this.isOf(socket) && this.opened();
    socket.onmessage = (event) => this.isOf(socket) && this.heard(event.data as string | ArrayBuffer);
    socket.onclose = () => this.isOf(socket) && this.lost();
    this.listen();
  }

  /** Begin again with a new line, which brings the whole mesh. */
  renew(): void {
    this.lost();
  }

  /** Gives the line up for good. */
  end(): void {
    clearInterval(this.countdown);
    this.drop();
    this.change({ kind: "ended" });
  }

  /** @param within ms; motions of an arm take minutes. */
  call<T>(service: string, request: object = {}, within = ANSWER_WITHIN): Promise<T> {
    const id = this.nextId++;
    return new Promise<T>((resolve, reject) => {
      if (!this.send({ id, call: service, request })) return reject(new CallError("lost"));
      const timer = setTimeout(() => this.calls.delete(id) && reject(new CallError("late")), within);
      this.calls.set(id, { resolve: resolve as (response: unknown) => void, reject, timer });
    });
  }

  /** @returns whether it went onto the line. */
  send(message: object): boolean {
    if (this.socket === null || this.state.kind !== "connected") return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  private isOf(socket: WebSocket): boolean {
    return this.socket === socket;
  }

  private opened(): void {
    this.change({ kind: "connected" });
    this.listen();
  }

  private heard(data: string | ArrayBuffer): void {
    this.listen();
    // something came: the next loss begins with the shortest wait again
    this.tries = 0;
    if (typeof data !== "string") return this.onBytes(data);
    let message: { topic?: string; message?: unknown; id?: number; response?: unknown; error?: string };
    try {
      message = JSON.parse(data);
    } catch (error) {
      console.warn("not JSON:", error);
      return;
    }
    if (message.topic !== undefined) {
      for (const listener of this.topics.get(message.topic) ?? []) listener(message.message as never);
    } else if (message.id !== undefined) {
      this.answered(message.id, message.response, message.error);
    }
  }

  private answered(id: number, response: unknown, error: string | undefined): void {
    const call = this.calls.get(id);
    if (call === undefined) return;
    this.calls.delete(id);
    clearTimeout(call.timer);
    if (error === undefined) call.resolve(response);
    else call.reject(new CallError("refused", error));
  }

  private listen(): void {
    clearTimeout(this.silence);
    this.silence = setTimeout(() => this.lost(), SILENCE);
  }

  private lost(): void {
    this.drop();
    const wait = WAITS[Math.min(this.tries, WAITS.length - 1)];
    this.tries++;
    let seconds = wait / 1000;
    this.change({ kind: "waiting", seconds });
    clearInterval(this.countdown);
    this.countdown = setInterval(() => {
      seconds -= 1;
      if (seconds > 0) this.change({ kind: "waiting", seconds });
      else this.connect();
    }, 1000);
  }

  private drop(): void {
    clearTimeout(this.silence);
    const socket = this.socket;
    this.socket = null;
    socket?.close();
    for (const call of this.calls.values()) {
      clearTimeout(call.timer);
      call.reject(new CallError("lost"));
    }
    this.calls.clear();
  }

  private change(state: LineState): void {
    this.state = state;
    for (const listener of this.stateListeners) listener(state);
  }
}
