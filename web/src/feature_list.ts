/**
 * All features as a list: number, kind, size with U, and whether that is good enough. A row stays the same element while its numbers
 * change, so that focus and place in the list stay too.
 */
import { button, el, picture, write } from "./dom";
import { isAsked, isMinor, kindText, mainWords, need } from "./feature_facts";
import { onLanguage, t } from "./language";
import { type NotedFeature, FittedTo, Status } from "./messages";
import type { Model } from "./model";
import { percent } from "./numbers";
import type { Operating } from "./operating";
import { keep, settings } from "./settings";

interface Row {
  element: HTMLButtonElement;
  number: HTMLElement;
  name: HTMLElement;
  size: HTMLElement;
  state: HTMLElement;
  lock: SVGElement;
}

export class FeatureList {
  readonly element: HTMLElement;
  private readonly list = el("ul", { class: "features" });
  private readonly empty = el("p", { class: "muted", text: "noFeatures" });
  private readonly rows = new Map<number, Row>();
  private readonly all = el("input", { id: "show-all", attributes: { type: "checkbox" } });

  constructor(
    private readonly model: Model,
    operating: Operating,
    private readonly onSelect: (id: number) => void,
    onFilter: () => void,
  ) {
    const detect = button("search", "detect", () => void operating.call("~/detect_features", {}, (answer) => answer.message));
    // a replay finds them by itself
    detect.hidden = model.replayed !== null;
    this.all.checked = settings.showsAll;
    this.all.addEventListener("change", () => {
      keep({ showsAll: this.all.checked });
      this.show();
      onFilter();
    });
    this.element = el(
      "section",
      { class: "card", attributes: { "aria-labelledby": "features-title" } },
      el("div", { class: "row" }, el("h2", { id: "features-title", text: "features" }), operating.guard(detect)),
      this.empty,
      this.list,
      el("div", { class: "field check" }, this.all, el("label", { text: "showAll", attributes: { for: "show-all" } })),
    );
    model.on(["features", "selected", "state"], () => this.show());
    onLanguage(() => this.show());
    this.show();
  }

  show(): void {
    const shown = this.model.features.filter((feature) => settings.showsAll || !isMinor(feature));
    const ids = new Set(shown.map((feature) => feature.id));
    for (const [id, row] of this.rows) {
      if (ids.has(id)) continue;
      row.element.parentElement?.remove();
      this.rows.delete(id);
    }
    shown.forEach((feature, at) => {
      const row = this.rows.get(feature.id) ?? this.add(feature.id);
      const item = row.element.parentElement;
      if (item !== null && this.list.children[at] !== item) this.list.insertBefore(item, this.list.children[at] ?? null);
      this.fill(row, feature);
    });
    this.empty.hidden = shown.length > 0;
  }

  private add(id: number): Row {
    const [number, name, size, state] = ["number", "name", "size", "state"].map((part) => el("span", { class: part }));
    const element = el("button", { class: "feature", attributes: { type: "button" }, onClick: () => this.onSelect(id) });
    const lock = picture("lock");
    // the number of the feature stands on it, the lock below
    const badge = el("span", { class: "badge" }, number, lock);
    element.append(badge, el("span", { class: "top" }, name, state), size);
    this.list.append(el("li", {}, element));
    const row = { element, number, name, size, state, lock };
    this.rows.set(id, row);
    return row;
  }

  private fill(row: Row, feature: NotedFeature): void {
    write(row.number, String(feature.id));
    write(row.name, feature.name || t(kindText(feature.kind)));
    write(row.size, mainWords(feature));
    const [words, level] = judgement(feature);
    write(row.state, words);
    row.state.dataset.level = level;
    row.lock.classList.toggle("none", !feature.is_locked);
    row.element.classList.toggle("flagged", feature.status === Status.flagged);
    row.element.setAttribute("aria-current", String(feature.id === this.model.selected));
  }
}

/** State of a feature in a few words, with a sign that needs no colour. */
export function judgement(feature: NotedFeature): [words: string, level: "good" | "open" | "plain"] {
  const lock = feature.is_locked ? ` · ${t("locked")}` : "";
  if (feature.mark === "accepted") return [`✓ ${t("accepted")}${lock}`, "good"];
  if (feature.mark === "rejected") return [`✕ ${t("rejected")}${lock}`, "plain"];
  if (feature.status === Status.flagged) return [`◌ ${t("toMeasure")}`, "open"];
  const share = percent(feature.touched ?? 0);
  if (feature.fitted_to !== FittedTo.touches) {
    const words = (feature.touched ?? 0) > 0 ? t("tooLittle", { share }) : t("fromScan");
    return [`◌ ${words}${lock}`, isAsked(feature) ? "open" : "plain"];
  }
  const touched = t("touchedShare", { touches: feature.touch_count, share });
  const isReached = need(feature, settings.tolerance) === null;
  return [`${isReached ? "✓" : "◔"} ${touched}${lock}`, isReached ? "good" : "open"];
}
