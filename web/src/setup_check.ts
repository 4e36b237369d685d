/**
 * The fourth step: which calibrations the scene has, with what it costs to do without and how each is done; and what a recording of the
 * folder says of scan, tip and sensors.
 */
import { button, el, say, write } from "./dom";
import { t } from "./language";
import { type CheckFinding, changeSetup, type SetupFile, type SetupState } from "./setup_state";
import { type SetupDesk, SetupStep } from "./setup_step";
import type { TextKey } from "./texts";

type Calibration = keyof SetupState["calibrations"];

const CALIBRATIONS: Record<Calibration, { title: TextKey; cost: TextKey; how: TextKey; command: string }> = {
  tip: { title: "calibrationTip", cost: "calibrationTipCost", how: "calibrationTipHow", command: "touchup calibrate tip" },
  payload: { title: "calibrationPayload", cost: "calibrationPayloadCost", how: "calibrationPayloadHow", command: "touchup calibrate payload" },
  scan: { title: "calibrationScan", cost: "calibrationScanCost", how: "calibrationScanHow", command: "touchup calibrate scan" },
};

export class CheckStep extends SetupStep {
  private readonly calibrations = el("ul", { class: "choices-list" });
  private readonly question = el("p", { class: "question" });
  private readonly recordings = el("div", { class: "choices-list" });
  private readonly status = el("p", { attributes: { role: "status" } });
  private readonly findings = el("ul", { class: "choices-list" });
  private readonly over: HTMLButtonElement;
  private readonly overWords = el("span", {});
  private drawn = "";

  constructor(desk: SetupDesk) {
    super("check", 4, "checkTitle", desk);
    this.over = button("accept", "checkOver", () => void desk.attempt(this, () => changeSetup("check", {})), "primary");
    this.over.querySelector("span")?.replaceWith(this.overWords);
    this.body.append(
      el("p", { class: "muted", text: "checkScene" }),
      this.calibrations,
      this.question,
      this.recordings,
      this.status,
      this.findings,
      el("div", { class: "actions" }, this.over),
    );
  }

  isDone({ is_check_over }: SetupState): boolean {
    return is_check_over;
  }

  protected words({ check }: SetupState): string {
    if (check.state !== "found") return t("checkSkipped");
    const wrong = check.findings.filter(({ is_sure }) => is_sure).length;
    if (check.findings.length === 0) return t("findingNothing", { file: check.file });
    return t("findingCount", { file: check.file, wrong, doubtful: check.findings.length - wrong });
  }

  protected draw({ calibrations, recordings, check, folder }: SetupState): void {
    const isRunning = check.state === "running";
    const mayChange = this.desk.mayChange && !isRunning;
    write(this.question, recordings.length > 0 ? t("recordingQuestion") : t("recordingNone", { folder }));
    this.status.classList.toggle("fix", check.state === "refused");
    write(this.status, "");
    if (check.state === "running") write(this.status, t("recordingRunning", { file: check.file }));
    if (check.state === "refused") write(this.status, t("scanRefused", { file: check.file, reason: check.why }));
    say(this.overWords, check.state === "found" ? "checkOver" : "checkWithout");
    this.over.disabled = !mayChange;
    // the same again touches nothing, so that who is on a button stays there
    const drawn = JSON.stringify([calibrations, recordings, check, t("checkTitle")]);
    if (drawn !== this.drawn) {
      this.drawn = drawn;
      this.calibrations.replaceChildren(...(Object.keys(CALIBRATIONS) as Calibration[]).map((name) => calibration(name, calibrations[name])));
      this.recordings.replaceChildren(...recordings.map((file) => this.entry(file)));
      this.findings.replaceChildren(...(check.state === "found" ? findingLines(check) : []));
    }
    const chosen = check.state === "none" ? null : check.file;
    for (const each of this.recordings.querySelectorAll("button")) {
      each.disabled = !mayChange;
      each.setAttribute("aria-pressed", String(each.dataset.file === chosen));
    }
  }

  private entry({ name }: SetupFile): HTMLElement {
    const made = el("button", { class: "button choice", attributes: { type: "button" } }, el("strong", {}, name));
    made.dataset.file = name;
    made.addEventListener("click", () => void this.desk.attempt(this, () => changeSetup("check", { recording: name })));
    return made;
  }
}

/** What is there in one line; what is not with its cost, and behind a line how it is done. */
function calibration(name: Calibration, isThere: boolean): HTMLElement {
  const { title, cost, how, command } = CALIBRATIONS[name];
  const pill = el("span", { class: "pill", text: isThere ? "calibrationThere" : "calibrationMissing" });
  pill.dataset.level = isThere ? "good" : "warn";
  const head = el("span", { class: "row start" }, el("strong", { text: title }), pill);
  if (isThere) return el("li", { class: "calibration" }, head);
  const steps = el("ol", {}, el("li", { text: how }), el("li", {}, t("calibrationRun", { command })));
  return el("li", { class: "calibration" }, el("details", {}, el("summary", {}, head, el("span", { class: "muted", text: cost })), steps));
}

function findingLines({ file, findings, losses }: { file: string; findings: CheckFinding[]; losses: string[] }): HTMLElement[] {
  const line = (level: string, text: TextKey, words: string, remedy: string): HTMLElement => {
    const pill = el("span", { class: "pill", text });
    pill.dataset.level = level;
    return el("li", { class: "finding" }, pill, el("span", {}, words), remedy === "" ? null : el("strong", {}, remedy));
  };
  const found = findings.map(({ is_sure, measured, remedy }) => line(is_sure ? "bad" : "warn", is_sure ? "findingBad" : "findingDoubt", measured, remedy));
  const lost = losses.map((loss) => line("warn", "findingDoubt", loss, ""));
  const all = [...found, ...lost];
  return all.length > 0 ? all : [line("good", "findingGood", t("findingNothing", { file }), "")];
}
