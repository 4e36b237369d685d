/** The third step: the mounted ball. Its radius goes into every measured size, so only the operator can give it. */
import { button, el, write } from "./dom";
import { t } from "./language";
import { decimal, typedMillimetres } from "./numbers";
import { changeSetup, type SetupState } from "./setup_state";
import { type SetupDesk, SetupStep } from "./setup_step";

/** Decimals of a radius, mm: 0.1 µm. */
const DECIMALS = 4;

export class TipStep extends SetupStep {
  private readonly radius = el("input", { id: "tip-radius", attributes: { type: "text", inputmode: "decimal", autocomplete: "off" } });
  private readonly uncertainty = el("input", { id: "tip-uncertainty", attributes: { type: "text", inputmode: "decimal", autocomplete: "off" } });
  private readonly reading = el("p", { class: "reading", attributes: { role: "status" } });
  private readonly known = el("p", { class: "muted", text: "tipKnown" });
  private readonly use: HTMLButtonElement;
  /** Whether the fields show the known values. */
  private isFilled = false;

  constructor(desk: SetupDesk) {
    super("tip", 3, "tipTitle", desk);
    this.use = button("accept", "tipUse", () => {}, "primary");
    this.use.type = "submit";
    const form = el(
      "form",
      {},
      el("div", { class: "field" }, el("label", { text: "tipRadius", attributes: { for: "tip-radius" } }), this.radius),
      el("div", { class: "field" }, el("label", { text: "tipUncertainty", attributes: { for: "tip-uncertainty" } }), this.uncertainty),
      this.reading,
      el("div", { class: "actions" }, this.use),
    );
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.state();
    });
    for (const each of [this.radius, this.uncertainty]) {
      each.addEventListener("input", () => {
        each.removeAttribute("aria-invalid");
        this.say("");
        this.read();
      });
    }
    this.body.append(el("p", { class: "question", text: "tipQuestion" }), this.known, form);
  }

  isDone({ tip, needs_radius }: SetupState): boolean {
    return tip !== null || !needs_radius;
  }

  protected words({ tip }: SetupState): string {
    if (tip === null) return t("tipRigid");
    return t("tipDiameter", { diameter: plain(2 * tip.radius_mm) });
  }

  protected draw({ tip, known_radius_mm }: SetupState): void {
    const first = tip?.radius_mm ?? known_radius_mm;
    this.known.hidden = tip !== null || known_radius_mm === null;
    if (!this.isFilled && first !== null) {
      this.isFilled = true;
      this.radius.value = plain(first);
      this.uncertainty.value = tip?.uncertainty_mm == null ? "" : plain(tip.uncertainty_mm);
    }
    for (const each of [this.radius, this.uncertainty, this.use]) each.disabled = !this.desk.mayChange;
    this.read();
  }

  private read(): void {
    const radius = typedMillimetres(this.radius.value);
    write(this.reading, radius === null ? "" : t("tipDiameter", { diameter: plain(2 * radius * 1e3) }));
  }

  private state(): void {
    const [radius, uncertainty] = [this.radius, this.uncertainty].map(({ value }) => typedMillimetres(value));
    const isEmpty = this.uncertainty.value.trim() === "";
    for (const [field, isWrong] of [[this.radius, radius === null], [this.uncertainty, uncertainty === null && !isEmpty]] as const) {
      if (isWrong) field.setAttribute("aria-invalid", "true");
      else field.removeAttribute("aria-invalid");
    }
    if (radius === null || (uncertainty === null && !isEmpty)) return this.say(t("tipWrong"));
    const tip = { radius_mm: tidy(radius * 1e3), uncertainty_mm: uncertainty === null ? null : tidy(uncertainty * 1e3) };
    void this.desk.attempt(this, () => changeSetup("tip", tip));
  }
}

/** A decimal without the error of binary fractions. */
function tidy(mm: number): number {
  return Number(mm.toPrecision(12));
}

/** "1.5", "0.4997": as few decimals as it has. */
export function plain(mm: number): string {
  const decimals = [1, 2, 3].find((some) => Math.abs(mm - Number(mm.toFixed(some))) < 10 ** -(DECIMALS + 3)) ?? DECIMALS;
  return decimal(mm, decimals);
}
