/** Beats come each 20 ms while somebody holds the button, and end with every doubt about the hand on it. */
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { BEAT, HoldToRun } from "../src/hold_to_run";

/** As much of a button, window and document as the module asks for. */
class Target extends EventTarget {
  visibilityState = "visible";
  focus(): void {}
  setPointerCapture(): void {}
  getBoundingClientRect(): object {
    return { left: 0, right: 100, top: 0, bottom: 50 };
  }
}

const event = (name: string, fields: object = {}): Event =>
  Object.assign(new Event(name, { cancelable: true }), { pointerId: 1, button: 0, clientX: 10, clientY: 10, repeat: false, ...fields });

let button: Target;
let page: Target;
let win: Target;
let beats: number[];
let isLineThere: boolean;
let hold: HoldToRun;

beforeEach(() => {
  vi.useFakeTimers();
  [button, page, win, beats, isLineThere] = [new Target(), new Target(), new Target(), [], true];
  vi.stubGlobal("document", page);
  vi.stubGlobal("window", win);
  hold = new HoldToRun({
    button: button as unknown as HTMLElement,
    send: (beat) => isLineThere && beats.push(beat) > 0,
    mayBegin: () => true,
    onChange: () => {},
  });
});
afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

const press = (): void => void button.dispatchEvent(event("pointerdown"));

describe("while it is held", () => {
  it("a beat goes out at once and each 20 ms, numbered", () => {
    press();
    vi.advanceTimersByTime(4 * BEAT);
    expect(beats).toEqual([1, 2, 3, 4, 5]);
  });

  it.each([" ", "Enter"])("by the key %j too, however it repeats", (key) => {
    button.dispatchEvent(event("keydown", { key }));
    button.dispatchEvent(event("keydown", { key, repeat: true }));
    vi.advanceTimersByTime(BEAT);
    expect(beats).toEqual([1, 2]);
    button.dispatchEvent(event("keyup", { key }));
    expect(hold.isHeld).toBe(false);
  });

  it("a second finger changes nothing", () => {
    press();
    button.dispatchEvent(event("pointerup", { pointerId: 2 }));
    expect(hold.isHeld).toBe(true);
  });
});

describe("it ends", () => {
  const ends: Array<[string, () => void]> = [
    ["with the finger", () => button.dispatchEvent(event("pointerup"))],
    ["when the finger is lost", () => button.dispatchEvent(event("pointercancel"))],
    ["when the capture is lost", () => button.dispatchEvent(event("lostpointercapture"))],
    ["when the finger slides off", () => button.dispatchEvent(event("pointermove", { clientX: 101 }))],
    ["when the button loses the focus", () => button.dispatchEvent(event("blur"))],
    ["when the window loses the focus", () => win.dispatchEvent(event("blur"))],
    ["when the page goes", () => win.dispatchEvent(event("pagehide"))],
    [
      "when the page is hidden",
      () => {
        page.visibilityState = "hidden";
        page.dispatchEvent(event("visibilitychange"));
      },
    ],
    [
      "with the line",
      () => {
        isLineThere = false;
        vi.advanceTimersByTime(BEAT);
      },
    ],
  ];
  it.each(ends)("%s, and does not begin again by itself", (_, end) => {
    press();
    end();
    const sent = beats.length;
    isLineThere = true;
    page.visibilityState = "visible";
    vi.advanceTimersByTime(20 * BEAT);
    expect(hold.isHeld).toBe(false);
    expect(beats.length).toBe(sent);
  });
});

describe("it does not begin", () => {
  it("by another button of the mouse, by a key that repeats, or on a hidden page", () => {
    button.dispatchEvent(event("pointerdown", { button: 2 }));
    button.dispatchEvent(event("keydown", { key: " ", repeat: true }));
    page.visibilityState = "hidden";
    press();
    expect(beats).toEqual([]);
  });
});
