/**
 * The next touch and its reason, and the distance to the wanted tolerance.
 *
 * Next is the feature whose U is widest against the tolerance; one without numbers comes first.
 */
import type { Vector3 } from "three";
import { el, write } from "./dom";
import { isAsked, nearestTo, need, title, urgency } from "./feature_facts";
import { onLanguage, t } from "./language";
import type { NotedFeature } from "./messages";
import type { Model } from "./model";
import { decimal, percent, typedMillimetres, uncertainty } from "./numbers";
import { keep, settings } from "./settings";

export class Guidance {
  readonly element: HTMLElement;
  private readonly next = el("button", { class: "next", attributes: { type: "button" } });
  private readonly why = el("p", { class: "why" });
  private readonly how = el("p", { class: "muted how" });
  private readonly bar = el("progress", { id: "progress", label: "progress" });
  private readonly count = el("label", { attributes: { for: "progress" } });
  private target: NotedFeature | null = null;
  /** Target of the green arrow, m. */
  private arrowAt: Vector3 | null = null;

  constructor(
    private readonly model: Model,
    private readonly onTolerance: () => void,
    onShow: (feature: NotedFeature) => void,
  ) {
    this.next.addEventListener("click", () => this.target !== null && onShow(this.target));
    this.element = el(
      "section",
      { class: "card guidance", attributes: { "aria-labelledby": "guidance-title" } },
      el("h2", { id: "guidance-title", text: "guidanceTitle" }),
      el("div", { attributes: { "aria-live": "polite" } }, this.next, this.why),
      this.how,
      el("div", { class: "goal" }, this.count, this.bar, this.toleranceField()),
    );
    model.on(["features", "state"], () => this.show());
    onLanguage(() => this.show());
    this.show();
  }

  /** The green arrow is for the feature next to the tip, which may be another one than that of the next touch. */
  arrow(at: Vector3 | null): void {
    this.arrowAt = at;
    this.showHow();
  }

  private showHow(): void {
    const pointed = this.arrowAt === null ? null : nearestTo(this.arrowAt, this.model.features, Infinity);
    const isHere = pointed !== null && pointed.id === this.target?.id;
    write(this.how, t(isHere ? "guidanceArrow" : "guidanceSpread"));
  }

  private show(): void {
    const asked = this.model.features.filter(isAsked);
    const { tolerance } = settings;
    const reached = asked.filter((feature) => need(feature, tolerance) === null);
    this.target = null;
    for (const feature of asked) {
      // the operator has accepted it
      if (feature.is_locked || feature.mark === "accepted") continue;
      const most = this.target === null ? 0 : urgency(this.target, tolerance);
      if (urgency(feature, tolerance) > most) this.target = feature;
    }
    this.bar.max = Math.max(asked.length, 1);
    this.bar.value = reached.length;
    this.count.hidden = this.bar.hidden = asked.length === 0;
    write(this.count, t("progressCount", { reached: reached.length, all: asked.length }));
    this.next.hidden = this.target === null;
    this.how.hidden = this.target === null;
    if (this.target === null) {
      write(this.why, t(asked.length === 0 ? "guidanceNothing" : "guidanceDone"));
      return;
    }
    write(this.next, t("guidanceNext", { feature: title(this.target) }));
    write(this.why, this.reason(this.target));
    this.showHow();
  }

  private reason(feature: NotedFeature): string {
    const wanted = need(feature, settings.tolerance);
    if (wanted === null) return "";
    if (wanted.kind === "untouched") return t("needUntouched");
    if (wanted.kind === "little") return t("needLittle", { share: percent(wanted.share) });
    if (wanted.kind === "unknown") return t("needUnknown", { touches: wanted.touches });
    return t("needWide", {
      size: t(wanted.size),
      u: uncertainty(wanted.u),
      tolerance: uncertainty(settings.tolerance),
    });
  }

  private toleranceField(): HTMLElement {
    const field = el("input", { id: "tolerance", attributes: { type: "text", inputmode: "decimal", size: "6", autocomplete: "off" } });
    const fill = (): void => {
      field.value = decimal(settings.tolerance * 1e3, 4).replace(/0{1,3}$/, "");
    };
    fill();
    onLanguage(fill);
    field.addEventListener("change", () => {
      const typed = typedMillimetres(field.value);
      field.setAttribute("aria-invalid", String(typed === null));
      if (typed === null) return;
      keep({ tolerance: typed });
      fill();
      this.show();
      this.onTolerance();
    });
    return el("div", { class: "field" }, el("label", { text: "tolerance", attributes: { for: "tolerance" } }), field, el("span", {}, "mm"));
  }
}
