/** The line comes back by itself, in 1, 2, 4, 8, 8 s; silence is a loss; calls end, one way or another. */
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Connection, SILENCE } from "../src/connection";

class FakeSocket {
  static all: FakeSocket[] = [];
  binaryType = "";
  sent: string[] = [];
  isClosed = false;
  onopen: () => void = () => {};
  onmessage: (event: { data: unknown }) => void = () => {};
  onclose: () => void = () => {};
  constructor() {
    FakeSocket.all.push(this);
  }
  send(words: string): void {
    this.sent.push(words);
  }
  close(): void {
    this.isClosed = true;
  }
  says(message: object): void {
    this.onmessage({ data: JSON.stringify(message) });
  }
}

let connection: Connection;
const newest = (): FakeSocket => FakeSocket.all.at(-1)!;

beforeEach(() => {
  vi.useFakeTimers();
  FakeSocket.all = [];
  connection = new Connection("ws://here/ws", () => new FakeSocket() as unknown as WebSocket);
  connection.connect();
});
afterEach(() => vi.useRealTimers());

describe("the line", () => {
  it("is tried again after 1, 2, 4, 8, 8 s", () => {
    for (const seconds of [1, 2, 4, 8, 8]) {
      const tries = FakeSocket.all.length;
      newest().onclose();
      expect(connection.state).toEqual({ kind: "waiting", seconds });
      vi.advanceTimersByTime(1000 * seconds - 1);
      expect(FakeSocket.all.length).toBe(tries);
      vi.advanceTimersByTime(1);
      expect(FakeSocket.all.length).toBe(tries + 1);
    }
  });

  it("begins with the shortest wait again after something was heard", () => {
    newest().onclose();
    vi.advanceTimersByTime(1000);
    newest().onclose();
    vi.advanceTimersByTime(2000);
    newest().onopen();
    newest().says({ topic: "state", message: {} });
    newest().onclose();
    expect(connection.state).toEqual({ kind: "waiting", seconds: 1 });
  });

  it("counts the seconds down", () => {
    const seen: number[] = [];
    connection.onState((state) => state.kind === "waiting" && seen.push(state.seconds));
    for (let loss = 0; loss < 3; loss++) {
      newest().onclose();
      vi.advanceTimersByTime(1000 * 2 ** loss);
    }
    expect(seen).toEqual([1, 2, 1, 4, 3, 2, 1]);
  });

  it("is lost after 10 s of silence, and not while something comes", () => {
    newest().onopen();
    for (let second = 0; second < 30; second++) {
      vi.advanceTimersByTime(1000);
      newest().says({ topic: "diagnostics", message: {} });
    }
    expect(connection.state.kind).toBe("connected");
    const silent = newest();
    vi.advanceTimersByTime(SILENCE);
    expect(connection.state.kind).toBe("waiting");
    expect(silent.isClosed).toBe(true);
  });

  it("does not listen to a socket that was given up", () => {
    const old = newest();
    old.onclose();
    vi.advanceTimersByTime(1000);
    newest().onopen();
    old.onclose();
    expect(connection.state.kind).toBe("connected");
  });
});

describe("a call", () => {
  beforeEach(() => newest().onopen());

  it("gets its own answer", async () => {
    const [first, second] = [connection.call("~/undo", { strokes: 1 }), connection.call("~/redo")];
    expect(newest().sent.map((words) => JSON.parse(words))).toEqual([
      { id: 1, call: "~/undo", request: { strokes: 1 } },
      { id: 2, call: "~/redo", request: {} },
    ]);
    newest().says({ id: 2, error: "nothing to redo" });
    newest().says({ id: 1, response: { success: true } });
    await expect(first).resolves.toEqual({ success: true });
    await expect(second).rejects.toMatchObject({ reason: "refused", sentence: "nothing to redo" });
  });

  it("that is not answered fails in time", async () => {
    const late = expect(connection.call("~/undo", {}, 5000)).rejects.toMatchObject({ reason: "late" });
    vi.advanceTimersByTime(5000);
    await late;
  });

  it("fails with the line, and without one", async () => {
    const lost = expect(connection.call("~/undo")).rejects.toMatchObject({ reason: "lost" });
    newest().onclose();
    await lost;
    await expect(connection.call("~/undo")).rejects.toMatchObject({ reason: "lost" });
  });
});
