/**
 * The replay of a session: a banner that marks it, and its controls. `~/replay` sets it, and all pages of the session see the same place of
 * it.
 */
import type { Connection } from "./connection";
import { button, el, picture, say, write } from "./dom";
import { onLanguage, t } from "./language";
import type { ReplayState } from "./messages";
import type { Notices } from "./notices";
import { percent } from "./numbers";
import { clockTime } from "./replay_place";

const SPEEDS = [1, 4, 16];
/** Step of the slider, s. */
const STEP = 0.1;

export class Replay {
  /** Over everything, for as long as the page is there. */
  readonly banner: HTMLElement;
  /** In place of the bar of a session's actions. */
  readonly controls: HTMLElement;
  private state: ReplayState | null = null;
  private readonly title = el("strong");
  private readonly notes = el("span", { attributes: { role: "status" } });
  private readonly play = button("pause", "pause", () => this.toggle());
  private readonly speeds = new Map<number, HTMLButtonElement>();
  private readonly slider = el("input", { label: "replayPlace", attributes: { type: "range", min: "0", max: "0", step: String(STEP), value: "0" } });
  private readonly time = el("output", { class: "replay-time" });
  private readonly ahead = el("p", { class: "replay-ahead", attributes: { role: "status", hidden: "" } });
  private readonly share = el("progress", { attributes: { max: "1", "aria-hidden": "true" } });
  private readonly aheadWords = el("span");
  private isDragged = false;

  /** @param onReading the node reads it, and nothing is visible yet. @param onRefused there is none. */
  constructor(
    private readonly connection: Connection,
    private readonly session: string,
    private readonly notices: Notices,
    private readonly onReading: () => void,
    private readonly onRefused: () => void,
  ) {
    const back = el("a", { class: "button", attributes: { href: "/" } }, picture("back"), el("span", { text: "replayBack" }));
    const words = el("p", {}, this.title, " ", el("span", { text: "replayHow" }), " ", this.notes);
    this.banner = el("section", { class: "replay-banner" }, picture("play"), words, back);
    const speeds = el("div", { class: "replay-speeds", label: "replaySpeed", attributes: { role: "group" } }, ...SPEEDS.map((speed) => this.speed(speed)));
    this.ahead.append(this.share, this.aheadWords);
    this.controls = el("nav", { class: "toolbar replay-controls", label: "replay" }, this.play, speeds, this.slider, this.time, this.ahead);
    this.slider.addEventListener("input", () => {
      this.isDragged = true;
      this.showTime();
    });
    this.slider.addEventListener("change", () => {
      this.isDragged = false;
      void this.set({ at_s: this.slider.valueAsNumber });
    });
    connection.on("replay", (state) => this.take(state));
    onLanguage(() => this.show());
    this.show();
  }

  private speed(speed: number): HTMLButtonElement {
    const choice = el("button", { class: "button", attributes: { type: "button" }, onClick: () => void this.set({ speed }) }, `${speed}\u00a0×`);
    this.speeds.set(speed, choice);
    return choice;
  }

  private take(state: ReplayState): void {
    this.state = state;
    this.show();
    if (state.is_ready) return;
    if (state.error === null) return this.onReading();
    // the node would refuse another try as well
    this.connection.end();
    this.onRefused();
  }

  private toggle(): void {
    if (this.state === null) return;
    if (this.state.is_at_end) void this.set({ at_s: 0, is_paused: false });
    else void this.set({ is_paused: !this.state.is_paused });
  }

  private async set(request: { speed?: number; is_paused?: boolean; at_s?: number }): Promise<void> {
    try {
      await this.connection.call("~/replay", request);
    } catch (error) {
      this.notices.failed(error);
      this.show();
    }
  }

  private show(): void {
    const { state } = this;
    write(this.title, t("replayTitle", { session: this.session }));
    write(this.notes, this.noteWords());
    this.banner.classList.toggle("failed", state !== null && state.error !== null);
    const rests = state === null || !state.is_ready || state.error !== null;
    for (const control of [this.play, this.slider, ...this.speeds.values()]) control.disabled = rests;
    this.showPlay();
    for (const [speed, choice] of this.speeds) {
      choice.setAttribute("aria-pressed", String(state?.speed === speed));
      choice.setAttribute("aria-label", t("replayTimes", { speed }));
    }
    this.slider.max = String(state?.end_s ?? 0);
    if (!this.isDragged) this.slider.value = String(state?.target_s ?? state?.at_s ?? 0);
    this.showTime();
    this.showAhead();
  }

  private showPlay(): void {
    const isAtEnd = this.state?.is_at_end ?? false;
    const isPaused = this.state?.is_paused ?? false;
    const words = this.play.querySelector("span");
    if (words !== null) say(words, isAtEnd ? "replayFromStart" : isPaused ? "goOn" : "pause");
    this.play.querySelector("svg")?.replaceWith(picture(isAtEnd || isPaused ? "play" : "pause"));
  }

  private showTime(): void {
    const at = clockTime(this.isDragged ? this.slider.valueAsNumber : (this.state?.at_s ?? 0));
    const end = clockTime(this.state?.end_s ?? 0);
    write(this.time, `${at} / ${end}`);
    this.slider.setAttribute("aria-valuetext", at);
  }

  private showAhead(): void {
    const target = this.state?.target_s ?? null;
    const at = this.state?.at_s ?? 0;
    this.ahead.hidden = target === null;
    if (target === null) return;
    const share = target > 0 ? Math.min(at / target, 1) : 0;
    this.share.value = share;
    write(this.aheadWords, t("replayAhead", { time: clockTime(target), share: percent(share) }));
  }

  private noteWords(): string {
    const { state } = this;
    if (state === null) return "";
    const notes = [
      state.error === null ? "" : t("replayFailed", { reason: state.error }),
      state.damage === null ? "" : t("replayDamaged", { reason: state.damage }),
    ];
    return notes.filter((note) => note !== "").join(" ");
  }
}
