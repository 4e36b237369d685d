/** Meaning of the part's colours: the choice, and for it a legend with words or a scale in mm. */
import { COLOUR_MODES, type ColourMode, modeNamed, scaleEnd, UNKNOWN_COLOUR } from "./colours";
import { el } from "./dom";
import { onLanguage, t } from "./language";
import type { MeshStore } from "./mesh_store";
import type { MeshView } from "./mesh_view";
import { decimal, decimalsOf } from "./numbers";
import { keep, settings } from "./settings";
import type { Stage } from "./stage";

/** Time between two looks at the scale while the mesh changes, ms. */
const RENEW = 2000;

export class Legend {
  readonly element: HTMLElement;
  private readonly choice = el("select", { id: "colour-by" });
  private readonly key = el("div", { class: "key" });
  private mode: ColourMode = modeNamed(settings.colourBy);
  private end = 0;
  private renewing: ReturnType<typeof setTimeout> | null = null;

  constructor(
    private readonly store: MeshStore,
    private readonly view: MeshView,
    private readonly stage: Stage,
  ) {
    const name = el("label", { text: "colourBy", attributes: { for: "colour-by" } });
    this.element = el("section", { class: "legend", label: "legend" }, el("div", { class: "row" }, name, this.choice), this.folded());
    this.element.removeAttribute("title");
    this.choice.addEventListener("change", () => {
      this.mode = modeNamed(this.choice.value);
      keep({ colourBy: this.mode.name });
      this.apply();
    });
    onLanguage(() => this.draw());
    this.offer();
    this.apply();
  }

  /** The mesh has changed: soon its scale may be another one. */
  meshChanged(): void {
    if (this.renewing !== null) return;
    this.renewing = setTimeout(() => {
      this.renewing = null;
      this.offer();
      if (this.mode.categories === null && scaleEnd(this.mode, this.store) !== this.end) this.apply();
    }, RENEW);
  }

  /** The legend proper folds, and begins folded in a small picture. */
  private folded(): HTMLElement {
    const folded = el("details", {}, el("summary", { text: "legend" }), this.key);
    folded.open = !matchMedia("(max-width: 640px)").matches;
    return folded;
  }

  /** Offers only the numbers that the mesh has. */
  private offer(): void {
    const there = COLOUR_MODES.filter((mode) => mode.isThere(this.store));
    if (this.choice.options.length === there.length) return;
    this.choice.replaceChildren(...there.map(({ name, text }) => el("option", { text, attributes: { value: name } })));
    if (!there.includes(this.mode)) this.mode = there[0];
    this.choice.value = this.mode.name;
  }

  private apply(): void {
    this.end = this.mode.categories === null ? scaleEnd(this.mode, this.store) : 0;
    this.view.colourBy(this.mode, this.end);
    this.draw();
    this.stage.ask();
  }

  private draw(): void {
    const { categories, scale, isSigned, name } = this.mode;
    if (categories !== null) {
      const rows = categories.map(({ colour, text }) => el("li", {}, swatch(colour), el("span", { text })));
      this.key.replaceChildren(el("ul", {}, ...rows));
      return;
    }
    const bar = el("div", { class: "scale" });
    bar.style.background = `linear-gradient(to right, ${scale.join(", ")})`;
    const end = this.end * 1e3;
    const marks = isSigned ? [-end, 0, end] : [0, end / 2, end];
    const decimals = Math.max(decimalsOf(end) - 1, 1) + (isSigned ? 0 : 1);
    const words = marks.map((mark) => el("span", {}, decimal(mark, decimals)));
    const unit = el("p", { class: "muted" }, name === "uncertainty" ? t("unitUncertainty") : t("unitDeviation"));
    const unknown = name === "uncertainty" ? el("p", { class: "muted" }, swatch(UNKNOWN_COLOUR), t("notKnown")) : null;
    this.key.replaceChildren(bar, el("div", { class: "marks" }, ...words), unit, ...(unknown === null ? [] : [unknown]));
  }
}

function swatch(colour: string): HTMLElement {
  const made = el("span", { class: "swatch", attributes: { "aria-hidden": "true" } });
  made.style.background = colour;
  return made;
}
