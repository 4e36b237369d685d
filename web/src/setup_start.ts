/** The last step: everything in one line, and the button that begins. */
import { button, el, write } from "./dom";
import { t } from "./language";
import { changeSetup, type SetupState } from "./setup_state";
import { type SetupDesk, SetupStep } from "./setup_step";
import { plain } from "./setup_tip";
import { chosenSize, sizeWords } from "./setup_unit";

export class StartStep extends SetupStep {
  private readonly chosen = el("p", { class: "question" });
  private readonly how = el("p", { class: "muted" });
  private readonly status = el("p", { class: "reading", attributes: { role: "status" } });
  private readonly go: HTMLButtonElement;

  constructor(desk: SetupDesk) {
    super("start", 5, "startTitle", desk);
    this.go = button("play", "startGo", () => void desk.attempt(this, () => changeSetup("start", {})), "primary large");
    this.body.append(this.chosen, el("div", { class: "actions" }, this.go), this.how, this.status);
  }

  isDone(): boolean {
    return false;
  }

  protected words(): string {
    return "";
  }

  protected draw(state: SetupState): void {
    const { scan, tip, scene, stage } = state;
    const size = chosenSize(state);
    const file = scan.state === "read" ? scan.file : "";
    const values = { file, size: size === null ? "" : sizeWords(size), radius: tip === null ? "0" : plain(tip.radius_mm) };
    write(this.chosen, t("startSummary", values));
    write(this.how, t("startHow", { scene }));
    write(this.status, stage === "starting" ? t("starting") : "");
    this.go.disabled = !this.desk.mayChange;
  }
}
