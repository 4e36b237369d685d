/** Numbers of a calibration, as they are in the answer of the program and on the page. */
import { describe, expect, it } from "vitest";
import { numbersOf } from "../src/calibration_numbers";

/** With plain spaces. */
function plain(rows: Array<[string, string]>): Array<[string, string]> {
  return rows.map(([name, value]) => [name, value.replaceAll("\u00a0", " ")]);
}

describe("the numbers of a calibration", () => {
  it("has each component of the tip with twice its standard uncertainty, rounded up", () => {
    const found = { poses: 3000, left_out: 12, swing_deg: 17.6, offset_mm: { value: [2.10012, -1.3, -141.8], std: [0.0121, 0.005, 0.1] }, residual_mm: 0.03449 };
    const rows = plain(numbersOf({ what: "tip", found: found as never }));
    expect(rows.map(([, value]) => value)).toEqual([
      "2.100 ± 0.025 mm",
      "−1.300 ± 0.010 mm",
      "−141.80 ± 0.20 mm",
      "0.034 mm",
      "± 18°",
      "3000, 12 of them left out",
    ]);
    expect(rows[2][0]).toMatch(/z$/);
  });

  it("has the mass in grams, and leaves out what the noise lets expect where that is not known", () => {
    const vector = { value: [1, 2, 3], std: [0.5, 0.5, 0.5] };
    const found = {
      static_segments: 7,
      left_out: [],
      weight_n: 2.7241,
      weight_std_n: 0.002,
      mass_kg: 0.27769,
      mass_std_kg: 0.0002,
      centre_mm: vector,
      bias_force_n: vector,
      residual_force_n: 0.0031,
      expected_residual_n: null as number | null,
    };
    const values = (): string[] => plain(numbersOf({ what: "payload", found: found as never })).map(([, value]) => value);
    expect(values().slice(0, 2)).toEqual(["277.69 ± 0.40 g", "2.7241 ± 0.0040 N"]);
    expect(values()).not.toContain("0.005 N");
    expect(values().at(-1)).toBe("7");
    found.expected_residual_n = 0.005;
    expect(values()).toContain("0.005 N");
  });

  it("names the worst pair of a scan", () => {
    const found = {
      pairs: [{ name: "A", distance_mm: 0.02 }, { name: "hole B", distance_mm: 0.31 }, { name: "C", distance_mm: 0.1 }],
      rms_mm: 0.18,
      scan_to_space: { position_mm: [410, -220.00049, 130] },
      shift_std_mm: [0.05, 0.05, 0.1],
      turn_std_deg: [0.1, 0.2, 0.3],
    };
    const values = plain(numbersOf({ what: "scan", found: found as never })).map(([, value]) => value);
    expect(values).toEqual([
      "x 410.000, y −220.000, z 130.000 mm",
      "x ± 0.10 mm, y ± 0.10 mm, z ± 0.20 mm",
      "x ± 0.20°, y ± 0.40°, z ± 0.60°",
      "0.180 mm",
      "hole B: 0.310 mm",
      "3",
    ]);
  });
});
