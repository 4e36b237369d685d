/**
 * Controls of an arm that holds the probe: plan first, then approve, then hold to run; cancel and stop always at hand.
 *
 * The plan is a dry run: the part shows its path, nothing moves. Only an approved plan can run, and only while somebody holds the button.
 */
import { button, el, say, write } from "./dom";
import { title } from "./feature_facts";
import { HoldToRun } from "./hold_to_run";
import { onLanguage, t } from "./language";
import { type Answer, type NotedFeature, PLANNED, type ProbeResult, type State, STOPPED_FROM } from "./messages";
import type { Model } from "./model";
import type { Operating } from "./operating";
import { settings } from "./settings";

/** Limits of the time for a plan on a large mesh, and for a probing, ms. */
const PLAN_WITHIN = 120_000;
const PROBE_WITHIN = 30 * 60_000;

type Step = "choose" | "planning" | "planned" | "approved" | "running" | "done";

export class ArmPanel {
  readonly element: HTMLElement;
  private readonly words = el("p", { class: "arm-words", attributes: { role: "status" } });
  private readonly plan: HTMLButtonElement;
  private readonly approve: HTMLButtonElement;
  private readonly recover: HTMLButtonElement;
  private readonly run = el("button", { class: "button hold", attributes: { type: "button" } }, el("span", { text: "holdToRun" }));
  private readonly hold: HoldToRun;
  private step: Step = "choose";
  private target: number | null = null;
  private ended = "";
  private needsRecovery = false;

  constructor(
    private readonly model: Model,
    private readonly operating: Operating,
    private readonly onHold: (isHeld: boolean) => void,
  ) {
    this.plan = operating.guard(button("measure", "plan", () => void this.makePlan(), "primary"), () => this.canPlan);
    this.approve = operating.guard(button("accept", "approve", () => this.go("approved")), () => this.step === "planned");
    this.recover = operating.guard(button("play", "recover", () => void this.recoverArm()));
    const cancel = operating.guard(button("close", "cancel", () => void this.cancel()));
    const stop = operating.guard(button("stop", "stop", () => void this.stop(), "danger"));
    operating.guard(this.run, () => this.canRun);
    this.hold = new HoldToRun({
      button: this.run,
      send: (beat) => operating.connection.send({ beat }),
      mayBegin: () => this.canRun && model.mayOperate,
      onChange: (isHeld) => this.held(isHeld),
    });
    this.element = el(
      "section",
      { class: "card arm", attributes: { "aria-labelledby": "arm-title" } },
      el("h2", { id: "arm-title", text: "armTitle" }),
      this.words,
      el("div", { class: "actions" }, this.plan, this.approve, this.recover),
      this.run,
      el("div", { class: "actions two" }, cancel, stop),
      el("p", { class: "warning", text: "noEmergencyStop" }),
    );
    model.on(["state", "selected", "features", "line", "result"], () => this.show());
    onLanguage(() => this.show());
    this.show();
  }

  private get feature(): NotedFeature | undefined {
    return this.model.feature(this.model.selected);
  }

  private get arm(): State["arm"] {
    return this.model.state?.arm ?? null;
  }

  private get canPlan(): boolean {
    return this.feature !== undefined && this.step !== "planning" && this.step !== "running";
  }

  private get canRun(): boolean {
    return (this.step === "approved" || this.step === "running") && this.arm?.may_move === true && this.arm.stays_because == null;
  }

  private go(step: Step): void {
    this.step = step;
    this.operating.refresh();
    this.show();
  }

  private show(): void {
    const { arm } = this;
    this.element.hidden = arm === null;
    // a plan is for one feature: another choice needs another plan
    if (this.model.selected !== this.target && (this.step === "planned" || this.step === "approved")) return this.go("choose");
    const stays = arm?.stays_because ?? null;
    this.recover.hidden = !this.needsRecovery && stays === null;
    // one step at a time: later steps take no room
    const mayRun = this.step === "approved" || this.step === "running";
    this.plan.hidden = mayRun || !this.recover.hidden;
    this.approve.hidden = this.step !== "planned";
    this.run.hidden = !mayRun;
    this.run.classList.toggle("held", this.hold.isHeld);
    const label = this.run.querySelector("span");
    if (label !== null) say(label, this.hold.isHeld ? "holding" : "holdToRun");
    if (arm !== null) write(this.words, stays === null ? this.sentence(arm.may_move, arm.motion) : t("armStays", { reason: stays }));
  }

  private sentence(mayMove: boolean, motion: string): string {
    const name = this.feature === undefined ? "" : title(this.feature);
    if (!mayMove && this.step !== "done") return t("armMayNot");
    if (motion === "retracts") return t("armRetracts");
    switch (this.step) {
      case "choose": return this.feature === undefined ? t("armChoose") : t("armPlanFirst", { feature: name });
      case "planning": return t("armPlanning", { feature: name });
      case "planned": return `${t("armPlanned")} ${this.ended}`;
      case "approved": return t("armApproved");
      case "running": return this.hold.isHeld ? t("armRuns") : t("armStands");
      case "done": return this.ended;
    }
  }

  private async makePlan(): Promise<void> {
    const { feature } = this;
    if (feature === undefined) return;
    this.target = feature.id;
    this.go("planning");
    const result = await this.probe(feature.id, true, PLAN_WITHIN);
    const isPlanned = result?.code === PLANNED;
    this.ended = isPlanned ? result.message : t("armNoPlan", { reason: result?.message ?? "" });
    this.go(isPlanned ? "planned" : result === null ? "choose" : "done");
  }

  private held(isHeld: boolean): void {
    this.onHold(isHeld);
    if (isHeld && this.step === "approved") void this.start();
    this.show();
  }

  private async start(): Promise<void> {
    if (this.target === null) return;
    this.go("running");
    const result = await this.probe(this.target, false, PROBE_WITHIN);
    this.hold.end();
    this.ended = result?.message ?? "";
    this.needsRecovery = (result?.code ?? 0) >= STOPPED_FROM;
    this.go(result === null ? "choose" : "done");
  }

  private async probe(id: number, isDryRun: boolean, within: number): Promise<ProbeResult | null> {
    try {
      // the tolerance of a probing is that of 95 %, as U with k = 2 nearly is
      const request = { id, settings: { dry_run: isDryRun, tolerance: settings.tolerance } };
      const answer = await this.operating.connection.call<{ result: ProbeResult }>("~/probe_feature", request, within);
      return answer.result;
    } catch (error) {
      this.operating.notices.failed(error);
      return null;
    }
  }

  /** Stops and draws back; the node pauses afterwards, since no call only cancels. */
  private async cancel(): Promise<void> {
    this.hold.end();
    await this.operating.call<Answer>("~/pause", { data: true }, () => t("cancelled"));
  }

  private async stop(): Promise<void> {
    this.hold.end();
    this.needsRecovery = true;
    await this.operating.call<Answer>("~/stop", {}, () => t("stopped"));
    this.show();
  }

  private async recoverArm(): Promise<void> {
    const answer = await this.operating.call<Answer>("~/recover", {}, () => t("recovered"));
    if (answer !== null) this.needsRecovery = false;
    this.go("choose");
  }
}
