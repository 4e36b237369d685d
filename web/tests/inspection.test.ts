import { describe, expect, it } from "vitest";
import { type Characteristic, countWords, type Decision, valueWords, worstFirst } from "../src/inspection";
import { asked, isMesh, type ReportForm } from "../src/report_request";

function characteristic(number: string, decision: Decision, probability?: number, more: object = {}): Characteristic {
  return { number, name: "hole 1 diameter", quantity: "diameter_mm", decision, is_at_least: false, conformance_probability: probability, ...more };
}

const FORM: ReportForm = {
  nominal: "upload", file: null, unit: "mm", align: "", general: "", rule: "iso14253", confidence: "95", part: " Plate & co ", serial: "", operator: "Ö",
};

describe("an inspection on the page", () => {
  it("begins with what failed, then what is undecided, each by its probability to conform", () => {
    const all = [
      characteristic("1", "pass", 0.99), characteristic("2", "undecided", 0.6), characteristic("3", "fail", 0.04), characteristic("4", "undecided"),
      characteristic("5", "fail", 0.001), characteristic("6", "pass", 0.96), characteristic("7", "undecided", 0.2),
    ];
    expect(worstFirst(all).map(({ number }) => number)).toEqual(["5", "3", "4", "7", "2", "6", "1"]);
    expect(all[0].number).toBe("1");
  });

  it("says values with expanded uncertainty and limits, and what was not measured", () => {
    const numbers = { actual_mm: 8.0214, expanded_uncertainty_mm: 0.0251, lower_limit_mm: 7.9, upper_limit_mm: 8.1 };
    expect(valueWords(characteristic("1", "pass", 1, numbers))).toBe("8.021\u00a0±\u00a00.025\u00a0mm (7.900 … 8.100)");
    expect(valueWords(characteristic("1", "undecided", 1, { upper_limit_mm: 0.05 }))).toBe("not measured yet (≤ 0.050)");
    const cone = { quantity: "cone_angle_deg", actual_deg: 90, is_at_least: true, lower_limit_deg: 89 };
    expect(valueWords(characteristic("1", "pass", 1, cone))).toBe("≥ 90.000° (≥ 89.000)");
    expect(countWords({ date: "", verdict: "fail", counts: { pass: 11, fail: 1 }, characteristics: [], notes: [] })).toBe("11 pass, 1 fail, 0 undecided");
  });
});

describe("what is asked of a report", () => {
  it("leaves out what is empty, and has the confidence as a share", () => {
    expect(asked({ ...FORM, file: { name: "plate.csv" } as File })).toBe(
      "nominal=upload&file=plate.csv&rule=iso14253&confidence=0.95&part=Plate+%26+co&operator=%C3%96",
    );
    expect(new URLSearchParams(asked({ ...FORM, confidence: "97,5" })).get("confidence")).toBe("0.975");
  });

  it("names a unit for a CAD mesh alone, and the file of the session by its name", () => {
    expect(asked({ ...FORM, file: { name: "plate.STL" } as File, unit: "inch" })).toContain("unit=inch");
    expect(isMesh("plate.csv")).toBe(false);
    expect(asked({ ...FORM, nominal: "nominal.json" })).toContain("nominal=session&file=nominal.json");
    expect(asked({ ...FORM, nominal: "part", align: "best-fit" })).toMatch(/^nominal=part&align=best-fit/);
    expect(asked({ ...FORM, nominal: "part", general: "iso2768-m" })).toMatch(/^nominal=part&general=iso2768-m/);
  });
});
