/** The second step: the size of the part gives the unit of its scan. One is likely; the user confirms it. */
import { el, write } from "./dom";
import { t } from "./language";
import { decimal } from "./numbers";
import { count } from "./setup_scan";
import { changeSetup, type ScanFacts, type SetupState, type UnitChoice } from "./setup_state";
import { type SetupDesk, SetupStep } from "./setup_step";
import { likeWhat } from "./size_words";
import type { TextKey } from "./texts";

const UNITS: Record<UnitChoice["unit"], TextKey> = { mm: "unitMm", m: "unitM", inch: "unitInch" };

export class UnitStep extends SetupStep {
  private readonly units = el("div", { class: "choices-list" });
  private readonly facts = el("ul", { class: "facts muted" });

  constructor(desk: SetupDesk) {
    super("unit", 2, "unitTitle", desk);
    this.body.append(
      el("p", { class: "question", text: "unitQuestion" }),
      this.units,
      el("p", { class: "muted", text: "unitNotThese" }),
      this.facts,
    );
  }

  isDone({ unit }: SetupState): boolean {
    return unit !== null;
  }

  protected words(state: SetupState): string {
    const chosen = chosenSize(state);
    return chosen === null ? "" : `${t("unitSize", { size: sizeWords(chosen) })}, ${t(UNITS[chosen.unit])}`;
  }

  protected draw({ scan, unit }: SetupState): void {
    if (scan.state !== "read") return;
    const drawn = JSON.stringify([scan, unit, this.desk.mayChange, t("unitQuestion")]);
    if (this.units.dataset.drawn === drawn) return;
    this.units.dataset.drawn = drawn;
    this.units.replaceChildren(...scan.units.map((choice) => this.entry(choice, unit)));
    this.facts.replaceChildren(...factWords(scan).map((words) => el("li", {}, words)));
  }

  private entry(choice: UnitChoice, chosen: SetupState["unit"]): HTMLElement {
    const longest = Math.max(...choice.sides_m);
    const like = choice.is_plausible ? t("unitLike", { thing: t(likeWhat(longest)) }) : t("unitImpossible");
    const likely = choice.is_likely ? el("span", { class: "pill plain" }) : null;
    if (likely !== null) write(likely, t("unitLikely"));
    const made = el(
      "button",
      { class: "button choice", attributes: { type: "button", "aria-pressed": String(choice.unit === chosen) } },
      el("strong", {}, t("unitSize", { size: sizeWords(choice) })),
      el("span", {}, like),
      el("span", { class: "muted" }, t(UNITS[choice.unit])),
      likely,
    );
    made.disabled = !choice.is_plausible || !this.desk.mayChange;
    made.addEventListener("click", () => void this.desk.attempt(this, () => changeSetup("unit", { unit: choice.unit })));
    return made;
  }
}

/** The size in the chosen unit. */
export function chosenSize({ scan, unit }: SetupState): UnitChoice | null {
  if (scan.state !== "read") return null;
  return scan.units.find((choice) => choice.unit === unit) ?? null;
}

/** "127 × 64 × 35", mm, the longest first. */
export function sizeWords({ sides_m }: UnitChoice): string {
  const sides = [...sides_m].sort((a, b) => b - a);
  return sides.map((side) => decimal(side * 1e3, side < 0.01 ? 1 : 0)).join(" × ");
}

/** Facts of the scan. */
function factWords({ faces, is_of_points, repair }: ScanFacts): string[] {
  const dropped = repair.dropped_not_finite + repair.dropped_zero_area + repair.dropped_duplicates;
  const counted: Array<[TextKey, number, number]> = [
    ["factLoops", repair.boundary_loops, 0],
    ["factPieces", repair.components, 1],
    ["factBranches", repair.non_manifold_edges, 0],
    ["factDropped", dropped, 0],
  ];
  const words = counted.filter(([, number, usual]) => number > usual).map(([text, number]) => t(text, { count: count(number) }));
  return [t("factFaces", { count: count(faces) }), ...(is_of_points ? [t("factPoints")] : []), ...words];
}
