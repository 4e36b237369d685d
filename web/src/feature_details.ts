/**
 * One feature in full: its sizes with U, their support, form, relations, the curves of its touches; and its actions. The buttons stay while
 * the numbers change under them.
 */
import { button, el, say, write } from "./dom";
import { curvePlot } from "./curve_plot";
import { coneWords, mainWords, sizes, title } from "./feature_facts";
import { judgement } from "./feature_list";
import { onLanguage, t } from "./language";
import { type Mark, type NotedFeature, type ProbeTouch, Status } from "./messages";
import type { Model } from "./model";
import { angle, length, percent } from "./numbers";
import type { Operating } from "./operating";
import type { TextKey } from "./texts";

const FORM_TEXTS: Record<number, TextKey> = { 1: "roundness", 2: "cylindricity", 3: "straightness", 4: "flatness" };
const RELATION_TEXTS: Record<number, TextKey> = { 1: "perpendicularity", 2: "parallelism", 3: "coaxiality", 4: "distance" };

export class FeatureDetails {
  readonly element: HTMLElement;
  private readonly heading = el("h2", { id: "details-title", attributes: { tabindex: "-1" } });
  private readonly main = el("p", { class: "main-size" });
  private readonly judged = el("p", { class: "judged" });
  private readonly numbers = el("dl", { class: "numbers" });
  private readonly curves = el("div", { class: "curves" });
  private readonly name = el("input", { id: "feature-name", attributes: { type: "text", maxlength: "80", autocomplete: "off" } });
  private readonly marks: Record<string, HTMLButtonElement>;
  private plots = new Map<ProbeTouch, HTMLElement>();
  private readonly unflagButton: HTMLButtonElement;
  private shown: number | null = null;

  constructor(
    private readonly model: Model,
    private readonly operating: Operating,
  ) {
    const back = button("back", "back", () => model.select(null), "ghost", true);
    const measure = button("measure", "measureBetter", () => void this.measure(), "primary");
    const unflag = button("reject", "unflag", () => void this.unflag());
    this.marks = {
      accepted: button("accept", "accept", () => void this.annotate({ mark: this.mark === "accepted" ? "none" : "accepted" })),
      rejected: button("reject", "reject", () => void this.annotate({ mark: this.mark === "rejected" ? "none" : "rejected" })),
      locked: button("lock", "lock", () => void this.annotate({ is_locked: !this.feature?.is_locked })),
    };
    this.name.addEventListener("change", () => void this.annotate({ name: this.name.value.trim() }));
    for (const each of [measure, this.name, ...Object.values(this.marks)]) operating.guard(each);
    operating.guard(unflag);
    this.unflagButton = unflag;
    const field = el("div", { class: "field" }, el("label", { text: "name", attributes: { for: "feature-name" } }), this.name);
    this.element = el(
      "section",
      { class: "card details", attributes: { "aria-labelledby": "details-title" } },
      el("div", { class: "row start" }, back, this.heading),
      el("div", {}, this.main, this.judged),
      measure,
      el("div", { class: "actions" }, ...Object.values(this.marks), unflag),
      this.numbers,
      field,
      this.curves,
    );
    model.on(["features", "selected", "state"], () => this.show());
    model.on(["touches", "selected"], () => this.showCurves());
    onLanguage(() => {
      this.plots.clear();
      this.show();
      this.showCurves();
    });
    this.show();
  }

  private get feature(): NotedFeature | undefined {
    return this.model.feature(this.model.selected);
  }

  private get mark(): Mark {
    return this.feature?.mark ?? "none";
  }

  private show(): void {
    const { feature } = this;
    this.element.hidden = feature === undefined;
    if (feature === undefined) {
      this.shown = null;
      return;
    }
    write(this.heading, title(feature));
    if (document.activeElement !== this.name) this.name.value = feature.name;
    this.unflagButton.hidden = feature.search_radius === null;
    const [words, level] = judgement(feature);
    write(this.main, mainWords(feature));
    write(this.judged, words);
    this.judged.dataset.level = level;
    this.marks.accepted.setAttribute("aria-pressed", String(feature.mark === "accepted"));
    this.marks.rejected.setAttribute("aria-pressed", String(feature.mark === "rejected"));
    const lock = this.marks.locked.querySelector("span");
    if (lock !== null) say(lock, feature.is_locked ? "unlock" : "lock");
    this.numbers.replaceChildren(...this.facts(feature).flatMap(([term, words]) => [el("dt", {}, term), el("dd", {}, words)]));
    if (this.shown !== feature.id) {
      this.shown = feature.id;
      this.operating.refresh();
      this.element.scrollIntoView({ block: "start" });
      this.heading.focus({ preventScroll: true });
    }
  }

  private facts(feature: NotedFeature): Array<[string, string]> {
    const facts: Array<[string, string]> = [];
    for (const size of sizes(feature)) facts.push([t(size.text), size.isAtLeast ? `${size.words} · ${t("endNotFelt")}` : size.words]);
    const cone = coneWords(feature);
    if (cone !== null) facts.push([t("coneAngle"), cone]);
    if (feature.through > 0) facts.push([t("through"), t(feature.through === 2 ? "yes" : "no")]);
    if (feature.status !== Status.flagged) {
      facts.push([t("touches"), String(feature.touch_count)], [t("touchedSurface"), percent(feature.touched ?? 0)]);
    }
    const { x, y, z } = feature.center;
    const place = [x, y, z].map((each) => length(each, null)?.replace("\u00a0mm", "") ?? "–").join(" / ");
    facts.push([t("place"), `${place} mm`]);
    for (const form of feature.form) {
      const words = length(form.zone, form.zone_std);
      const key = FORM_TEXTS[form.characteristic];
      if (words !== null && key !== undefined) facts.push([t(key), `${words} · ${t("seenShare", { share: percent(form.coverage ?? 0) })}`]);
    }
    return [...facts, ...this.relations(feature)];
  }

  private relations(feature: NotedFeature): Array<[string, string]> {
    const facts: Array<[string, string]> = [];
    for (const relation of this.model.relations) {
      const key = RELATION_TEXTS[relation.kind];
      if (key === undefined || (relation.of_feature !== feature.id && relation.to_feature !== feature.id)) continue;
      const other = this.model.feature(relation.of_feature === feature.id ? relation.to_feature : relation.of_feature);
      const words = [
        length(relation.zone, relation.zone_std),
        length(relation.distance, relation.distance_std),
        angle(relation.angle, relation.angle_std),
      ].filter((each) => each !== null);
      if (other !== undefined) facts.push([t("relationTo", { relation: t(key), feature: title(other) }), words.join(" · ")]);
    }
    return facts;
  }

  private showCurves(): void {
    const touches = this.model.touches.get(this.model.selected ?? -1) ?? [];
    const plots = touches.map((touch) => this.plots.get(touch) ?? curvePlot(touch));
    // existing plots stay: each new touch costs one drawing
    this.plots = new Map(touches.map((touch, i) => [touch, plots[i]]));
    const heading = touches.length > 0 ? [el("h3", { text: "curves" }), el("p", { class: "muted", text: "curvesHow" })] : [];
    this.curves.replaceChildren(...heading, ...plots);
  }

  private async measure(): Promise<void> {
    const { feature } = this;
    if (feature === undefined) return;
    const request = {
      kind: feature.kind,
      point: { header: { frame_id: this.model.frame }, point: feature.center },
      search_radius: feature.search_radius ?? Math.max(feature.diameter ?? 0, feature.width ?? 0, feature.length ?? 0, 4e-3) * 0.75,
    };
    await this.operating.call("~/flag_feature", request, () => t("willMeasure", { feature: title(feature) }));
  }

  private async unflag(): Promise<void> {
    const { feature } = this;
    if (feature !== undefined) await this.operating.call("~/unflag_feature", { id: feature.id }, () => t("unflagged"));
  }

  private async annotate(change: { name?: string; mark?: Mark; is_locked?: boolean }): Promise<void> {
    const { feature } = this;
    if (feature === undefined) return;
    await this.operating.call("~/annotate_feature", { id: feature.id, ...change });
  }
}
