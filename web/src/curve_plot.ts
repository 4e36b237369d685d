/**
 * A force curve of one touch as a small drawing: force against the approach over travel, with axes in mm and N; the force across as a
 * dashed line.
 */
import { el, svg } from "./dom";
import { t } from "./language";
import type { Num, ProbeTouch } from "./messages";
import { decimal } from "./numbers";

const WIDTH = 280;
const HEIGHT = 110;
const LEFT = 34;
const BOTTOM = 20;
const TOP = 8;
/** Points of a line at most: more than pixels are invisible. */
const MOST_POINTS = 400;

const VERDICTS = [
  "verdictUnclear", "verdictClean", "verdictSlip", "verdictEdge", "verdictBounce", "verdictImpact", "verdictMiss", "verdictHeldBack",
  "verdictUnclear",
] as const;

export function curvePlot(touch: ProbeTouch): HTMLElement {
  const verdict = t(VERDICTS[touch.verdict] ?? "verdictUnclear");
  const words = t("touchNumber", { number: touch.index + 1 });
  const used = t(touch.accepted ? "touchUsed" : "touchNotUsed");
  const caption = el("figcaption", {}, `${words}: ${verdict}. ${used}${touch.reason ? ` (${touch.reason})` : ""}`);
  return el("figure", { class: "curve" }, caption, ...(touch.curve_travel.length > 1 ? [plot(touch, `${words}: ${verdict}`)] : []));
}

function plot(touch: ProbeTouch, name: string): SVGElement {
  const travel = numbers(touch.curve_travel).map((x) => x * 1e3);
  const along = numbers(touch.curve_force);
  const across = numbers(touch.curve_lateral_force);
  const [left, right] = range(travel);
  const [low, high] = range([...along, ...across, 0]);
  const x = (mm: number): number => LEFT + ((mm - left) / (right - left)) * (WIDTH - LEFT - 6);
  const y = (newtons: number): number => HEIGHT - BOTTOM - ((newtons - low) / (high - low)) * (HEIGHT - BOTTOM - TOP);
  const step = Math.max(1, Math.ceil(travel.length / MOST_POINTS));
  const line = (forces: number[]): string =>
    forces.flatMap((newtons, i) => (i % step === 0 ? [`${x(travel[i]).toFixed(1)},${y(newtons).toFixed(1)}`] : [])).join(" ");
  const text = (words: string, at: [number, number], anchor: string): SVGElement => {
    const made = svg("text", { x: at[0], y: at[1], "text-anchor": anchor });
    made.textContent = words;
    return made;
  };
  return svg(
    "svg",
    { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": name },
    svg("path", { class: "axis", d: `M${LEFT} ${TOP}V${HEIGHT - BOTTOM}H${WIDTH - 6}M${LEFT} ${y(0)}H${WIDTH - 6}` }),
    svg("polyline", { class: "across", points: line(across) }),
    svg("polyline", { class: "along", points: line(along) }),
    text(`${decimal(high, 1)} N`, [LEFT - 4, TOP + 8], "end"),
    text(decimal(low, 1), [LEFT - 4, HEIGHT - BOTTOM], "end"),
    text(decimal(left, 2), [LEFT, HEIGHT - 6], "start"),
    text(`${decimal(right, 2)} mm`, [WIDTH - 6, HEIGHT - 6], "end"),
  );
}

function numbers(from: Num[]): number[] {
  return from.map((number) => number ?? 0);
}

/** Never empty, so that no division is by zero. */
function range(of: number[]): [number, number] {
  let [low, high] = [Infinity, -Infinity];
  for (const number of of) {
    low = Math.min(low, number);
    high = Math.max(high, number);
  }
  return high > low ? [low, high] : [low - 0.5, low + 0.5];
}
