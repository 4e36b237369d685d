/** Draws a QR code: dark on light in every theme, with the quiet zone of four modules that readers need (ISO/IEC 18004). */
import { svg } from "./dom";
import { t } from "./language";

const QUIET = 4;

/** - `rows`: 1 for a dark module. */
export function codePicture(rows: string[]): SVGElement {
  const side = rows.length + 2 * QUIET;
  const background = svg("path", { class: "light", d: `M0 0h${side}v${side}h-${side}z` });
  const dark = svg("path", { class: "dark", d: modules(rows) });
  const about = { viewBox: `0 0 ${side} ${side}`, role: "img", "aria-label": t("codeOfLink"), "shape-rendering": "crispEdges" };
  return svg("svg", about, background, dark);
}

/** Path over all dark modules, with the quiet zone before them: a rectangle for each run in a row. */
export function modules(rows: string[]): string {
  const of = (row: string, y: number): string =>
    [...row.matchAll(/1+/g)].map(({ 0: run, index }) => `M${index + QUIET} ${y + QUIET}h${run.length}v1h-${run.length}z`).join("");
  return rows.map(of).join("");
}
