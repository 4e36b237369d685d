/**
 * Numbers as an operator reads them: mm and degrees, the decimal sign of the language, and only significant digits.
 *
 * U is the expanded uncertainty with k = 2. It has two significant digits, rounded up, so that it never looks smaller than it is; the value
 * gets the decimals of its U [JCGM 100, 7.2.6].
 */
import { locale } from "./language";
import type { Num } from "./messages";

/** Of the expanded uncertainty U = k · u: about 95 %. */
export const COVERAGE_FACTOR = 2;
/** Decimals of a length in mm at most: 0.1 µm, the limit of all knowledge here. */
const MOST_DECIMALS = 4;
/** Decimals of a length in mm whose uncertainty is not known. */
const PLAIN_DECIMALS = 2;
/** Largest error of a decimal in binary fractions, relative. */
const ROUNDING = 1e-9;

/** By language and decimals: making one takes longer than a hundred numbers. */
const formats = new Map<string, Intl.NumberFormat>();

export function decimal(number: number, decimals: number): string {
  const key = `${locale()} ${decimals}`;
  let format = formats.get(key);
  if (format === undefined) {
    const options = { minimumFractionDigits: decimals, maximumFractionDigits: decimals, useGrouping: false };
    format = new Intl.NumberFormat(locale(), options);
    formats.set(key, format);
  }
  return format.format(number).replace("-", "−");
}

/** Decimals with which a number greater than 0 shows two digits that count. */
export function decimalsOf(number: number): number {
  if (!(number > 0)) return PLAIN_DECIMALS;
  const decimals = 1 - Math.floor(Math.log10(number) + ROUNDING);
  return Math.min(Math.max(decimals, 0), MOST_DECIMALS);
}

function roundedUp(number: number, decimals: number): number {
  const power = 10 ** decimals;
  return Math.ceil(number * power * (1 - ROUNDING)) / power;
}

/** Expanded uncertainty of a standard one, in the same unit. */
export function expanded(std: Num): number | null {
  return std === null || !Number.isFinite(std) ? null : COVERAGE_FACTOR * std;
}

/** "8.021 ± 0.025 mm", "≥ 8.0 mm", "8.02 mm"; null without a value. From m. */
export function length(value: Num, std: Num, isAtLeast = false): string | null {
  return withU(value, std, 1e3, "mm", isAtLeast);
}

/** "0.12 ± 0.03°". From rad. */
export function angle(value: Num, std: Num): string | null {
  return withU(value, std, 180 / Math.PI, "°", false);
}

function withU(value: Num, std: Num, factor: number, unit: string, isAtLeast: boolean): string | null {
  if (value === null || !Number.isFinite(value)) return null;
  const sign = isAtLeast ? "≥ " : "";
  const space = unit === "°" ? "" : "\u00a0";
  const u = expanded(std);
  if (u === null) return `${sign}${decimal(value * factor, PLAIN_DECIMALS)}${space}${unit}`;
  let decimals = decimalsOf(u * factor);
  const up = roundedUp(u * factor, decimals);
  // 0.0996 becomes 0.10, not 0.100
  decimals = Math.min(decimals, decimalsOf(up));
  return `${sign}${decimal(value * factor, decimals)}\u00a0±\u00a0${decimal(up, decimals)}${space}${unit}`;
}

/** "12.31 ± 0.04 N": a value and its standard uncertainty, both in that unit. */
export function measured(value: number, std: number, unit: string): string {
  return withU(value, std, 1, unit, false) ?? "";
}

/** "0.025": an expanded uncertainty, whatever its unit. */
export function roundedUncertainty(u: number): string {
  const decimals = decimalsOf(u);
  return decimal(roundedUp(u, decimals), decimals);
}

/** "± 0.025 mm", from m. */
export function uncertainty(u: number): string {
  return `±\u00a0${roundedUncertainty(u * 1e3)}\u00a0mm`;
}

/** "1.2 N" */
export function force(newtons: number): string {
  return `${decimal(newtons, 1)}\u00a0N`;
}

/** "42 %", from a share of 1. */
export function percent(share: number): string {
  return new Intl.NumberFormat(locale(), { style: "percent", maximumFractionDigits: 0 }).format(share);
}

/** "3.4 MB" */
export function bytes(count: number): string {
  const step = count >= 1e9 ? 3 : count >= 1e6 ? 2 : count >= 1e3 ? 1 : 0;
  return `${decimal(count / 1e3 ** step, step === 0 ? 0 : 1)}\u00a0${["B", "kB", "MB", "GB"][step]}`;
}

/** A typed number in mm, with comma or point; null for other text. */
export function typedMillimetres(text: string): number | null {
  const number = Number(text.trim().replace(",", "."));
  return text.trim() !== "" && Number.isFinite(number) && number > 0 ? number / 1e3 : null;
}

