/** Numbers with U: two digits that count, rounded up, the value with the same decimals, the sign of the language. */
import { describe, expect, it } from "vitest";
import { roundedUp } from "../src/colours";
import { speak } from "../src/language";
import { angle, bytes, length, percent, typedMillimetres, uncertainty } from "../src/numbers";

/** Spaces that do not break are spaces here. */
const plain = (words: string | null): string | undefined => words?.replaceAll("\u00a0", " ");


describe("a length", () => {
  it.each([
    [8.0213e-3, 12.34e-6, "8.021 ± 0.025 mm"],
    [8.0213e-3, 10e-6, "8.021 ± 0.020 mm"],
    [8.0213e-3, 49.8e-6, "8.02 ± 0.10 mm"],
    [8.0213e-3, 0.05e-6, "8.0213 ± 0.0001 mm"],
    [8.0213e-3, 6e-3, "8 ± 12 mm"],
    [8.0213e-3, 0.6e-3, "8.0 ± 1.2 mm"],
    [8.0213e-3, null, "8.02 mm"],
    [-0.5e-3, 50e-6, "−0.50 ± 0.10 mm"],
  ])("of %d m with u = %d m is %s", (value, std, words) => {
    expect(plain(length(value, std))).toBe(words);
  });

  it("that is a bound says so", () => {
    expect(plain(length(8e-3, null, true))).toBe("≥ 8.00 mm");
  });

  it("that is not known is none", () => {
    expect(length(null, 1e-6)).toBeNull();
  });
});

describe("other numbers", () => {
  it("never say U smaller than it is", () => {
    for (let u = 1e-7; u < 1e-2; u *= 1.137) {
      const said = Number(/±\u00a0([\d.]+)/.exec(uncertainty(u))?.[1]);
      expect(said).toBeGreaterThanOrEqual(u * 1e3 * (1 - 1e-8));
      if (u > 1e-6) expect(said).toBeLessThanOrEqual(u * 1e3 * 1.1 + 1e-9);
    }
  });

  it("are angles in degrees, shares, sizes of files", () => {
    expect(plain(angle(Math.PI / 2, Math.PI / 1800))).toBe("90.00 ± 0.20°");
    expect(percent(0.416)).toBe("42%");
    expect([12, 3456, 12_345_678].map((count) => plain(bytes(count)))).toEqual(["12 B", "3.5 kB", "12.3 MB"]);
  });

  it("are read as they are typed", () => {
    expect(["0,02", "0.02", " 1 ", "", "x", "-1", "0"].map(typedMillimetres)).toEqual([2e-5, 2e-5, 1e-3, null, null, null, null]);
  });

  it("end scales at 1, 2 or 5", () => {
    expect([0.9, 1, 1.1, 2.1, 5.1, 0].map((number) => roundedUp(number * 1e-3) * 1e3)).toEqual([1, 1, 2, 5, 10, 1]);
  });
});

describe("in German", () => {
  it("the decimal sign is a comma", () => {
    const page = { documentElement: { lang: "" }, querySelectorAll: () => [] };
    Object.assign(globalThis, { document: page });
    speak("de");
    expect(plain(length(8.0213e-3, 12.34e-6))).toBe("8,021 ± 0,025 mm");
    speak("en");
    Reflect.deleteProperty(globalThis, "document");
  });
});
