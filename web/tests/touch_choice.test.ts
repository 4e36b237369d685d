/** The offered touch for any order of answers. */
import { describe, expect, it } from "vitest";
import type { MeshStore } from "../src/mesh_store";
import { type FoundTouch, isTouched, putBackRequest, takeOutRequest, TouchChoice } from "../src/touch_choice";

function found(sec: number, success = true): FoundTouch {
  return { success, message: "", touch: { sec, nanosec: 250 }, contacts: 7, points: [] };
}

/** A node that answers on command. */
function node(): { asked: object[]; answer: Array<(touch: FoundTouch) => void>; ask: (request: object) => Promise<FoundTouch> } {
  const asked: object[] = [];
  const answer: Array<(touch: FoundTouch) => void> = [];
  return {
    asked,
    answer,
    ask: (request) => {
      asked.push(request);
      return new Promise((resolve) => answer.push(resolve));
    },
  };
}

describe("the touch at a place", () => {
  it("is what the node finds there, and nothing is changed by asking", async () => {
    const { asked, answer, ask } = node();
    let changes = 0;
    const choice = new TouchChoice(ask, () => changes++);
    const looked = choice.look([0.01, 0.02, 0.03], "object");
    answer[0](found(5));
    await looked;
    const point = { header: { frame_id: "object" }, point: { x: 0.01, y: 0.02, z: 0.03 } };
    expect(asked).toEqual([{ point, preview: true }]);
    expect([choice.chosen?.touch.sec, changes]).toEqual([5, 1]);
    choice.forget();
    expect([choice.chosen, changes]).toEqual([null, 2]);
  });

  it("is that of the last tap, though an earlier one is answered later", async () => {
    const { answer, ask } = node();
    const choice = new TouchChoice(ask, () => {});
    const looks = [choice.look([0, 0, 0], "object"), choice.look([1, 0, 0], "object")];
    answer[1](found(2));
    answer[0](found(1));
    await Promise.all(looks);
    expect(choice.chosen?.touch.sec).toBe(2);
  });

  it("is none once the menu was closed, nor where nothing was touched", async () => {
    const { answer, ask } = node();
    let changes = 0;
    const choice = new TouchChoice(ask, () => changes++);
    const looked = choice.look([0, 0, 0], "object");
    choice.forget();
    answer[0](found(1));
    await looked;
    const again = choice.look([0, 0, 0], "object");
    answer[1](found(2, false));
    await again;
    expect([choice.chosen, changes]).toEqual([null, 0]);
  });
});

it("a touch goes and comes by its name", () => {
  expect(takeOutRequest(found(5))).toEqual({ touch: { sec: 5, nanosec: 250 } });
  expect(putBackRequest(found(5))).toEqual({ touch: { sec: 5, nanosec: 250 }, put_back: true });
});

it("a face is touched where one of its corners is", () => {
  // support of vertex 2: touched, of vertex 3: interpolated
  const quality = new Uint8Array([0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0, 1, 2, 0, 0, 1]);
  const store = { corners: new Uint32Array([0, 1, 3, 0, 1, 2]), quality } as MeshStore;
  expect([isTouched(store, 0), isTouched(store, 1)]).toEqual([false, true]);
});
