/** Buttons over the picture: directions of view, and the force at the tip. */
import type { CameraMan, ViewName } from "./camera_man";
import { button, el, write } from "./dom";
import { onLanguage, t } from "./language";
import { force } from "./numbers";
import type { TextKey } from "./texts";

const VIEWS: Record<ViewName, TextKey> = { whole: "viewWhole", top: "viewTop", front: "viewFront", side: "viewSide" };

export class ViewBar {
  readonly element = el("div", { class: "views", label: "views", attributes: { role: "group" } });

  constructor(camera: CameraMan) {
    for (const name of Object.keys(VIEWS) as ViewName[]) {
      this.element.append(button(name, VIEWS[name], () => camera.show(name), "square", true));
    }
    const follow = button("follow", "viewFollow", () => set(!camera.follows), "square", true);
    const set = (follows: boolean): void => {
      camera.follows = follows;
      follow.setAttribute("aria-pressed", String(follows));
    };
    camera.onFreed = () => set(false);
    set(false);
    this.element.append(follow);
  }
}

/** Full length of the bar, N; harder presses fill it. */
const FULL = 10;
/** Age at which the display drops a force, ms. */
const LASTS = 2000;
/** Above this a stylus presses harder than it should, N. */
const HARD = 6;

export class ForceBar {
  readonly element: HTMLElement;
  private readonly fill = el("div", { class: "force-fill" });
  private readonly words = el("span", { class: "force-words" });
  private newtons = 0;
  private fading: ReturnType<typeof setTimeout> | undefined;

  constructor() {
    const bar = el("div", { class: "force-track", attributes: { "aria-hidden": "true" } }, this.fill);
    this.element = el("div", { class: "force", attributes: { hidden: "" } }, this.words, bar);
    onLanguage(() => this.element.hidden || this.show(this.newtons));
  }

  show(newtons: number): void {
    this.newtons = newtons;
    this.element.hidden = false;
    clearTimeout(this.fading);
    this.fading = setTimeout(() => (this.element.hidden = true), LASTS);
    this.fill.style.transform = `scaleX(${Math.min(newtons / FULL, 1).toFixed(3)})`;
    this.element.dataset.level = newtons > HARD ? "bad" : "good";
    write(this.words, newtons > HARD ? `${force(newtons)} · ${t("forceHard")}` : `${t("force")} ${force(newtons)}`);
  }
}
