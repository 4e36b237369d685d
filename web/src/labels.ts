/**
 * Words at places of the part: the numbers of features, which react to a tap, and the distance at the tip. They are HTML, so that they stay
 * sharp, and screen readers and keyboards reach them.
 */
import { Vector3 } from "three";
import { el, write } from "./dom";
import { title } from "./feature_facts";
import { type NotedFeature, Status, triple } from "./messages";
import type { Stage } from "./stage";

/** Distance of the words at the tip from it, as in the style sheet, px. */
const TIP_OFFSET = 20;

interface Label {
  element: HTMLButtonElement;
  place: Vector3;
  axis: Vector3 | null;
}

export class Labels {
  readonly layer = el("div", { class: "labels" });
  private readonly features = new Map<number, Label>();
  private readonly tipNumber = el("strong");
  private readonly tipFeature = el("span");
  private readonly tip = el("output", { class: "tip-label", attributes: { "aria-live": "off" } }, this.tipNumber, this.tipFeature);
  private tipPlace: Vector3 | null = null;

  constructor(
    private readonly stage: Stage,
    private readonly onSelect: (id: number) => void,
  ) {
    this.layer.append(this.tip);
    stage.afterFrame.push(() => this.move());
  }

  show(features: NotedFeature[], selected: number | null): void {
    const shown = new Set<number>();
    for (const feature of features) {
      const center = triple(feature.center);
      if (center === null) continue;
      shown.add(feature.id);
      const label = this.features.get(feature.id) ?? this.add(feature.id);
      label.place.set(...center);
      const axis = triple(feature.axis);
      label.axis = axis === null ? null : new Vector3(...axis);
      write(label.element, String(feature.id));
      label.element.setAttribute("aria-label", title(feature));
      label.element.classList.toggle("flagged", feature.status === Status.flagged);
      label.element.classList.toggle("locked", feature.is_locked);
      label.element.classList.toggle("rejected", feature.mark === "rejected");
      label.element.setAttribute("aria-pressed", String(feature.id === selected));
    }
    for (const [id, label] of this.features) {
      if (shown.has(id)) continue;
      label.element.remove();
      this.features.delete(id);
    }
    this.stage.ask();
  }

  /** @param place null: no tip is there. */
  showTip(place: Vector3 | null, number: string, feature: string): void {
    this.tipPlace = place;
    write(this.tipNumber, number);
    write(this.tipFeature, feature);
    this.tip.hidden = place === null;
  }

  private add(id: number): Label {
    const element = el("button", { class: "feature-label", attributes: { type: "button" }, onClick: () => this.onSelect(id) });
    const label = { element, place: new Vector3(), axis: null };
    this.features.set(id, label);
    this.layer.append(element);
    return label;
  }

  private move(): void {
    const { camera } = this.stage;
    for (const { element, place, axis } of this.features.values()) {
      this.put(element, place);
      const isBehind = axis !== null && axis.dot(camera.position.clone().sub(place)) < 0;
      element.classList.toggle("behind", isBehind);
    }
    if (this.tipPlace !== null) this.put(this.tip, this.tipPlace);
  }

  private put(element: HTMLElement, place: Vector3): void {
    const { width, height } = this.stage.size;
    const at = place.clone().project(this.stage.camera);
    const isInView = Math.abs(at.x) < 1 && Math.abs(at.y) < 1 && at.z < 1;
    element.classList.toggle("out", !isInView);
    const x = Math.min(((at.x + 1) / 2) * width, width - (element === this.tip ? element.offsetWidth + TIP_OFFSET : 0));
    const y = ((1 - at.y) / 2) * height;
    if (isInView) element.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
  }
}
