/**
 * One calibration in the setup: whether the scene has it and since when, instructions for the hand, the recording of it, its result, and
 * the button that puts it into the scene.
 */
import { found, numbersOf } from "./calibration_numbers";
import { button, el, write } from "./dom";
import { locale, t } from "./language";
import { bytes, percent } from "./numbers";
import { type CalibrationName, type CalibrationChoice, changeSetup, type SetupFile, type SetupState, sendFile } from "./setup_state";
import { refusalWords, type SetupDesk, type SetupStep } from "./setup_step";
import type { TextKey } from "./texts";

const CALIBRATIONS: Record<CalibrationName, { title: TextKey; cost: TextKey; how: TextKey; command: string }> = {
  tip: { title: "calibrationTip", cost: "calibrationTipCost", how: "calibrationTipHow", command: "touchup calibrate tip" },
  payload: { title: "calibrationPayload", cost: "calibrationPayloadCost", how: "calibrationPayloadHow", command: "touchup calibrate payload" },
  scan: { title: "calibrationScan", cost: "calibrationScanCost", how: "calibrationScanHow", command: "touchup calibrate scan" },
};

/** Files that a device offers: recordings, and tables if the calibration needs points. */
const RECORDINGS = ".mcap,.db3";
const TABLES = ".csv";
const DAY_MS = 86_400_000;

export class CalibrationCard {
  readonly element: HTMLElement;
  private readonly pill = el("span", { class: "pill" });
  private readonly cost = el("span", { class: "muted" });
  private readonly details: HTMLDetailsElement;
  private readonly inner = el("div", { class: "calibration-body" });
  private readonly tables = el("div", { class: "choices-list" });
  private readonly recordings = el("div", { class: "choices-list" });
  private readonly none = el("p", { class: "muted" });
  private readonly status = el("p", { attributes: { role: "status" } });
  private readonly progress = el("progress", { attributes: { max: "1", hidden: "" } });
  private readonly result = el("div", { class: "calibration-body" });
  private readonly input: HTMLInputElement;
  private readonly send: HTMLButtonElement;
  private readonly alone: HTMLButtonElement;
  private readonly use: HTMLButtonElement;
  /** The table of points chosen here. */
  private points: string | null = null;
  /** Sent share of this device's upload; null: none. */
  private sent: { file: string; share: number } | null = null;
  private drawn = { lists: "", result: "", state: "" };
  private state: SetupState | null = null;

  constructor(
    private readonly name: CalibrationName,
    private readonly step: SetupStep,
    private readonly desk: SetupDesk,
  ) {
    const { title, how, command } = CALIBRATIONS[name];
    const accept = this.needsPoints ? `${RECORDINGS},${TABLES}` : RECORDINGS;
    this.input = el("input", { label: "recordingSend", attributes: { type: "file", accept, hidden: "" } });
    this.input.addEventListener("change", () => void this.upload());
    this.send = button("share", this.needsPoints ? "recordingOrPointsSend" : "recordingSend", () => this.input.click());
    this.alone = button("play", "calibratePairs", () => this.run(null));
    this.use = button("accept", "calibrationUse", () => void this.desk.attempt(this.step, () => changeSetup("use", { what: this.name })), "primary");
    const steps = el("ol", {}, el("li", { text: how }), el("li", { text: this.needsPoints ? "calibrationChoosePoints" : "calibrationChoose" }));
    this.inner.hidden = true;
    this.inner.append(
      steps,
      this.tables,
      this.recordings,
      this.none,
      el("div", { class: "actions" }, this.send, this.alone, this.input),
      this.status,
      this.progress,
      this.result,
      el("div", { class: "actions" }, this.use),
      el("p", { class: "muted" }, el("span", { text: "calibrationRun" }), " ", el("code", {}, command)),
    );
    const head = el("span", { class: "row start" }, el("strong", { text: title }), this.pill);
    this.details = el("details", {}, el("summary", {}, head, this.cost), this.inner);
    // hides folded parts from fingers and screen readers
    this.details.addEventListener("toggle", () => (this.inner.hidden = !this.details.open));
    this.element = el("li", { class: "calibration" }, this.details);
  }

  private get needsPoints(): boolean {
    return this.name === "scan";
  }

  show(state: SetupState): void {
    this.state = state;
    const { calibrations, calibration, check, upload, scene } = state;
    const { is_there, date } = calibrations[this.name];
    write(this.pill, t(is_there ? "calibrationThere" : "calibrationMissing"));
    this.pill.dataset.level = is_there ? "good" : "warn";
    write(this.cost, is_there ? (date === null ? "" : dateWords(date)) : t(CALIBRATIONS[this.name].cost));
    const own = calibration.state !== "none" && calibration.what === this.name ? calibration : null;
    const isBusy = calibration.state === "running" || check.state === "running" || upload !== null || this.sent !== null;
    this.showLists(state, own, this.desk.mayChange && !isBusy);
    this.showProgress(own);
    this.showResult(own, scene);
    this.use.hidden = own?.state !== "found" || own.is_used;
    this.use.disabled = !this.desk.mayChange || isBusy;
    // shows the result, even of a calibration that somebody else began
    const now = own === null ? "" : `${own.state} ${own.file}`;
    if (now !== this.drawn.state && own !== null) {
      this.details.open = true;
      this.inner.hidden = false;
    }
    this.drawn.state = now;
  }

  private showLists({ recordings, tables, folder }: SetupState, own: OwnChoice, mayChange: boolean): void {
    if (!tables.some(({ name }) => name === this.points)) this.points = null;
    // the same lists again touch nothing, so that a focused button keeps the focus
    const lists = JSON.stringify([recordings, this.needsPoints ? tables : [], locale()]);
    if (lists !== this.drawn.lists) {
      this.drawn.lists = lists;
      this.recordings.replaceChildren(...recordings.map((file) => entry(file, () => this.run(file.name))));
      if (this.needsPoints) this.tables.replaceChildren(...tables.map((file) => entry(file, () => this.choosePoints(file.name))));
    }
    write(this.none, t("calibrationNone", { folder }));
    this.none.hidden = recordings.length > 0;
    const lacksPoints = this.needsPoints && this.points === null;
    for (const each of this.recordings.querySelectorAll("button")) {
      each.disabled = !mayChange || lacksPoints;
      each.setAttribute("aria-pressed", String(each.dataset.file === own?.file));
    }
    for (const each of this.tables.querySelectorAll("button")) {
      each.disabled = !mayChange;
      each.setAttribute("aria-pressed", String(each.dataset.file === this.points));
    }
    this.send.disabled = !mayChange;
    this.alone.hidden = !this.needsPoints;
    this.alone.disabled = !mayChange || lacksPoints;
  }

  private showProgress(own: OwnChoice): void {
    const { sent } = this;
    const share = sent?.share ?? (own?.state === "running" ? own.share : null);
    this.progress.hidden = sent === null && own?.state !== "running";
    if (share === null) this.progress.removeAttribute("value");
    else this.progress.value = share;
    let words = "";
    if (sent !== null) words = t("scanSending", { file: sent.file, share: percent(sent.share) });
    else if (own?.state === "running") words = t("calibrationRunning", { file: own.file });
    else if (own?.state === "refused") words = refusalWords(own.file, own.why);
    this.progress.setAttribute("aria-label", words);
    write(this.status, words);
    this.status.classList.toggle("fix", sent === null && own?.state === "refused");
  }

  private showResult(own: OwnChoice, scene: string): void {
    const drawn = own?.state === "found" ? JSON.stringify([own, scene, locale()]) : "";
    if (drawn === this.drawn.result) return;
    this.drawn.result = drawn;
    if (own?.state !== "found") return this.result.replaceChildren();
    const rows = numbersOf(found(own)).flatMap(([name, value]) => [el("dt", {}, name), el("dd", {}, value)]);
    const line = (level: string, text: TextKey, words: string): HTMLElement => {
      const pill = el("span", { class: "pill" });
      write(pill, t(text));
      pill.dataset.level = level;
      return el("li", { class: "finding" }, pill, el("span", {}, words));
    };
    const doubts = [...own.doubts, ...own.losses].map((words) => line("warn", "findingDoubt", words));
    const good = line("good", "findingGood", t("calibrationGood", { file: own.file }));
    const used = own.is_used ? el("p", { class: "reading" }, t("calibrationUsed", { scene })) : null;
    this.result.replaceChildren(
      el("dl", { class: "numbers" }, ...rows),
      el("p", { class: "muted" }, t("calibrationCoverage")),
      el("ul", { class: "choices-list" }, ...(doubts.length > 0 ? doubts : [good])),
      ...(used === null ? [] : [used]),
    );
  }

  private choosePoints(name: string): void {
    this.points = name;
    if (this.state !== null) this.show(this.state);
  }

  private run(recording: string | null): void {
    const request = { what: this.name, recording, points: this.needsPoints ? this.points : null };
    void this.desk.attempt(this.step, () => changeSetup("calibrate", request));
  }

  /** Sends a recording, which the node then calibrates, or a table, which becomes the choice. */
  private async upload(): Promise<void> {
    const file = this.input.files?.[0];
    // lets the user send the same file again
    this.input.value = "";
    if (file === undefined || this.state === null) return;
    const { largest_upload } = this.state;
    if (file.size > largest_upload) return this.step.say(t("recordingTooLarge", { file: file.name, size: bytes(largest_upload) }));
    const note = (share: number): void => {
      this.sent = { file: file.name, share };
      if (this.state !== null) this.show(this.state);
    };
    note(0);
    await this.desk.attempt(this.step, async () => {
      const name = await sendFile(file, note).finally(() => (this.sent = null));
      const isTable = name.toLowerCase().endsWith(TABLES);
      if (isTable) this.points = name;
      // points alone serve a recording already chosen
      if (isTable || (this.needsPoints && this.points === null)) return changeSetup("look", null);
      return changeSetup("calibrate", { what: this.name, recording: name, points: this.needsPoints ? this.points : null });
    });
  }
}

/** State of the calibration of a card. */
type OwnChoice = Exclude<CalibrationChoice, { state: "none" }> | null;

function entry({ name, bytes: length, modified_s }: SetupFile, onClick: () => void): HTMLElement {
  const when = modified_s === null ? "" : new Intl.DateTimeFormat(locale(), { dateStyle: "medium", timeStyle: "short" }).format(modified_s * 1000);
  const facts = [when, bytes(length)].filter((fact) => fact !== "").join(" · ");
  const made = el("button", { class: "button choice", attributes: { type: "button" }, onClick }, el("strong", {}, name), el("span", { class: "muted" }, facts));
  made.dataset.file = name;
  return made;
}

/** "27 Nov 2026, 12 days ago"; the day is one of UTC. */
function dateWords(date: string): string {
  const begin = Date.parse(date);
  const days = Math.max(0, Math.floor((Date.now() - begin) / DAY_MS));
  const age = new Intl.RelativeTimeFormat(locale(), { numeric: "auto" }).format(-days, "day");
  const day = new Intl.DateTimeFormat(locale(), { dateStyle: "medium", timeZone: "UTC" }).format(begin);
  return t("calibrationDate", { date: day, age });
}
