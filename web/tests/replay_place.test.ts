import { describe, expect, it } from "vitest";
import { clockTime, replayAddress, replayedIn, socketAddress } from "../src/replay_place";

describe("the place of a replay", () => {
  it("names its session, whatever characters are in it", () => {
    const session = "Tür 4&x=#1?";
    expect(replayedIn(new URL(replayAddress(session), "http://cell").search)).toBe(session);
    const socket = new URL(socketAddress({ protocol: "https:", host: "cell:1" }, session));
    expect([socket.protocol, socket.host, socket.pathname, socket.searchParams.get("replay")]).toEqual(["wss:", "cell:1", "/ws", session]);
  });

  it("is none where the page shows the session that runs", () => {
    expect(replayedIn("")).toBeNull();
    expect(socketAddress({ protocol: "http:", host: "cell" }, null)).toBe("ws://cell/ws");
  });

  it.each([[0, "0:00"], [9.96, "0:09"], [65, "1:05"], [3599.9, "59:59"], [3665, "1:01:05"]])("is %f s along it at %s", (seconds, words) => {
    expect(clockTime(seconds)).toBe(words);
  });
});
