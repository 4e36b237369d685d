/** The numbers of a calibration as an operator reads them: each with its expanded uncertainty, and the residual of the fit. */
import { t } from "./language";
import { decimal, expanded, measured, roundedUncertainty } from "./numbers";
import type { CalibrationChoice, PayloadFound, ScanFound, TipFound, VectorEstimate } from "./setup_state";

export type FoundCalibration = { what: "tip"; found: TipFound } | { what: "payload"; found: PayloadFound } | { what: "scan"; found: ScanFound };

/** Decimals of a residual in mm and in N. */
const RESIDUAL_DECIMALS = 3;
const AXES = ["x", "y", "z"] as const;

/** The result, without the rest. */
export function found(choice: Extract<CalibrationChoice, { state: "found" }>): FoundCalibration {
  return { what: choice.what, found: choice.found } as FoundCalibration;
}

/** Each number: its name and its value, in words. */
export function numbersOf(calibration: FoundCalibration): Array<[string, string]> {
  switch (calibration.what) {
    case "tip": return ofTip(calibration.found);
    case "payload": return ofPayload(calibration.found);
    case "scan": return ofScan(calibration.found);
  }
}

function ofTip({ offset_mm, residual_mm, swing_deg, poses, left_out }: TipFound): Array<[string, string]> {
  return [
    ...components(t("calibrationOffset"), offset_mm, "mm"),
    [t("calibrationResidual"), residual(residual_mm, "mm")],
    [t("calibrationSwing"), `±\u00a0${decimal(swing_deg, 0)}°`],
    [t("calibrationPoses"), counts(poses, left_out)],
  ];
}

function ofPayload(found: PayloadFound): Array<[string, string]> {
  const expected = found.expected_residual_n;
  return [
    [t("calibrationMass"), measured(found.mass_kg * 1e3, found.mass_std_kg * 1e3, "g")],
    [t("calibrationWeight"), measured(found.weight_n, found.weight_std_n, "N")],
    ...components(t("calibrationCentre"), found.centre_mm, "mm"),
    ...components(t("calibrationBias"), found.bias_force_n, "N"),
    [t("calibrationResidual"), residual(found.residual_force_n, "N")],
    ...(expected == null ? [] : [[t("calibrationExpected"), residual(expected, "N")] as [string, string]]),
    [t("calibrationSegments"), counts(found.static_segments, found.left_out.length)],
  ];
}

function ofScan({ scan_to_space, shift_std_mm, turn_std_deg, rms_mm, pairs }: ScanFound): Array<[string, string]> {
  const at = scan_to_space.position_mm.map((mm, axis) => `${AXES[axis]}\u00a0${decimal(mm, RESIDUAL_DECIMALS)}`);
  const known = (stds: readonly number[], unit: string): string =>
    stds.map((std, axis) => `${AXES[axis]}\u00a0±\u00a0${roundedUncertainty(expanded(std) ?? 0)}${unit}`).join(", ");
  const worst = pairs.reduce((a, b) => (b.distance_mm > a.distance_mm ? b : a), pairs[0]);
  return [
    [t("calibrationOrigin"), `${at.join(", ")}\u00a0mm`],
    [t("calibrationShift"), known(shift_std_mm, "\u00a0mm")],
    [t("calibrationTurn"), known(turn_std_deg, "°")],
    [t("calibrationResidual"), residual(rms_mm, "mm")],
    ...(worst === undefined ? [] : [[t("calibrationWorst"), `${worst.name}: ${residual(worst.distance_mm, "mm")}`] as [string, string]]),
    [t("calibrationPairs"), String(pairs.length)],
  ];
}

function components(name: string, { value, std }: VectorEstimate, unit: string): Array<[string, string]> {
  return AXES.map((axis, i) => [`${name}, ${axis}`, measured(value[i], std[i], unit)]);
}

function residual(value: number, unit: string): string {
  return `${decimal(value, RESIDUAL_DECIMALS)}\u00a0${unit}`;
}

function counts(all: number, leftOut: number): string {
  return leftOut === 0 ? String(all) : t("calibrationLeftOut", { count: all, left: leftOut });
}
