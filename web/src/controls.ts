/** The bar of an operator's frequent actions: undo, redo, pause, save, new session, report, sessions. */
import { ask, button, el, picture, say } from "./dom";
import { t } from "./language";
import type { Answer } from "./messages";
import type { Model } from "./model";
import type { Operating } from "./operating";

interface Saved extends Answer {
  path: string;
}

export class Controls {
  readonly element = el("nav", { class: "toolbar", label: "toolbar" });
  private readonly pause: HTMLButtonElement;

  constructor(
    private readonly model: Model,
    private readonly operating: Operating,
    showSessions: () => void,
    showReport: () => void,
  ) {
    const undo = button("undo", "undo", () => void operating.call("~/undo", { strokes: 1 }));
    const redo = button("redo", "redo", () => void operating.call("~/redo", { strokes: 1 }));
    this.pause = button("pause", "pause", () => void operating.call("~/pause", { data: !this.isPaused }));
    const save = button("save", "save", () => void this.save());
    const fresh = button("fresh", "newSession", () => void this.begin());
    const sessions = button("sessions", "sessions", showSessions);
    const report = button("report", "report", showReport);
    for (const each of [undo, redo, this.pause, save, fresh]) operating.guard(each);
    this.element.append(undo, redo, this.pause, save, fresh, report, sessions);
    model.on(["state"], () => this.show());
  }

  private get isPaused(): boolean {
    return this.model.state?.is_paused ?? false;
  }

  private show(): void {
    const words = this.pause.querySelector("span");
    if (words !== null) say(words, this.isPaused ? "goOn" : "pause");
    this.pause.querySelector("svg")?.replaceWith(picture(this.isPaused ? "play" : "pause"));
  }

  private async save(): Promise<void> {
    const request = { overwrite: true, with_features: true, with_step: true };
    await this.operating.call<Saved>("~/save_mesh", request, (answer) => t("saved", { path: answer.path }));
  }

  private async begin(): Promise<void> {
    if (await ask("newSessionQuestion", "newSession")) await this.operating.call("~/reset", {}, () => t("begun"));
  }
}
