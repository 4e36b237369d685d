/** The fourth step: the calibrations of the scene, and the findings of a recording of touches on scan, tip and sensors. */
import { button, el, say, write } from "./dom";
import { t } from "./language";
import { CalibrationCard } from "./setup_calibration";
import { type CheckFinding, changeSetup, type SetupFile, type SetupState } from "./setup_state";
import { refusalWords, type SetupDesk, SetupStep } from "./setup_step";
import type { TextKey } from "./texts";

/** In the order of their making. */
const CALIBRATIONS = ["tip", "payload", "scan"] as const;

export class CheckStep extends SetupStep {
  private readonly calibrations: CalibrationCard[];
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
    this.calibrations = CALIBRATIONS.map((name) => new CalibrationCard(name, this, desk));
    this.body.append(
      el("p", { class: "muted", text: "checkScene" }),
      el("ul", { class: "choices-list" }, ...this.calibrations.map(({ element }) => element)),
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

  protected draw(state: SetupState): void {
    const { recordings, calibration, check, folder } = state;
    for (const each of this.calibrations) each.show(state);
    const isRunning = check.state === "running" || calibration.state === "running";
    const mayChange = this.desk.mayChange && !isRunning;
    write(this.question, recordings.length > 0 ? t("recordingQuestion") : t("recordingNone", { folder }));
    this.status.classList.toggle("fix", check.state === "refused");
    write(this.status, "");
    if (check.state === "running") write(this.status, t("recordingRunning", { file: check.file }));
    if (check.state === "refused") write(this.status, refusalWords(check.file, check.why));
    say(this.overWords, check.state === "found" ? "checkOver" : "checkWithout");
    this.over.disabled = !mayChange;
    // the same again touches nothing, so that a focused button keeps the focus
    const drawn = JSON.stringify([recordings, check, t("checkTitle")]);
    if (drawn !== this.drawn) {
      this.drawn = drawn;
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
