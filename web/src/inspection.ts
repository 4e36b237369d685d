/**
 * An inspection as `results.json` of a session has it (docs/inspect.md), as far as the page shows it: decisions in words, the worst
 * first. Lengths in mm, angles in degrees.
 */
import { t } from "./language";
import { decimal } from "./numbers";
import type { TextKey } from "./texts";

export const DECISIONS = ["fail", "undecided", "pass"] as const;
export type Decision = (typeof DECISIONS)[number];

/** Its numbers stand beside these fields, as `actual_mm` and `deviation_deg`. */
export interface Characteristic {
  number: string;
  name: string;
  quantity: string;
  decision: Decision;
  is_at_least: boolean;
  reason?: string;
  conformance_probability?: number;
}

export interface Inspection {
  date: string;
  verdict: Decision;
  counts: Partial<Record<Decision, number>>;
  characteristics: Characteristic[];
  notes: string[];
}

/** Of a sign, as the pills of the page have it. */
export const LEVELS: Record<Decision, string> = { pass: "good", undecided: "warn", fail: "bad" };
const WORDS: Record<Decision, TextKey> = { pass: "decisionPass", undecided: "decisionUndecided", fail: "decisionFail" };
/** As in the report. */
const DECIMALS = 3;

export function decisionWord(decision: Decision): string {
  return t(WORDS[decision]);
}

/**
 * Failed ones first, then undecided, then passed ones; within a group the less probable to conform first, and unmeasured ones before all.
 */
export function worstFirst(all: Characteristic[]): Characteristic[] {
  const rank = ({ decision }: Characteristic): number => DECISIONS.indexOf(decision);
  const probability = (one: Characteristic): number => one.conformance_probability ?? -1;
  return [...all].sort((a, b) => rank(a) - rank(b) || probability(a) - probability(b));
}

/** "11 pass, 1 fail, 1 undecided" */
export function countWords({ counts }: Inspection): string {
  const count = (decision: Decision): number => counts[decision] ?? 0;
  return t("decisionCounts", { pass: count("pass"), fail: count("fail"), undecided: count("undecided") });
}

/** "8.021 ± 0.025 mm (7.900 to 8.100)"; "not measured (…)". */
export function valueWords(one: Characteristic): string {
  const unit = one.quantity.endsWith("_deg") ? "deg" : "mm";
  const number = (name: string): number | null => {
    const value = (one as unknown as Record<string, unknown>)[`${name}_${unit}`];
    return typeof value === "number" ? value : null;
  };
  const words = (value: number): string => decimal(value, DECIMALS);
  const [actual, u, lower, upper] = ["actual", "expanded_uncertainty", "lower_limit", "upper_limit"].map(number);
  const spread = u === null ? "" : `\u00a0±\u00a0${words(u)}`;
  const shownUnit = unit === "deg" ? "°" : "\u00a0mm";
  const value = actual === null ? t("notMeasured") : `${one.is_at_least ? "≥ " : ""}${words(actual)}${spread}${shownUnit}`;
  if (lower === null) return upper === null ? value : `${value} (≤ ${words(upper)})`;
  return upper === null ? `${value} (≥ ${words(lower)})` : `${value} (${words(lower)} … ${words(upper)})`;
}
