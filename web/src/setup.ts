/**
 * Before the first touch, for people who never saw the page: is the part as large as it is, does anything come from the sensors, does the
 * tip feel nothing in the air, and does the ball lie at the touched place. Four steps, one at a time, each with its remedy.
 */
import { button, el, say, write } from "./dom";
import { onLanguage, t } from "./language";
import type { MeshStore } from "./mesh_store";
import type { Model } from "./model";
import { decimal, force } from "./numbers";
import { keep, settings } from "./settings";
import { likeWhat } from "./size_words";
import type { TextKey } from "./texts";
import type { TipState } from "./tip_view";

const STEPS = ["size", "input", "free", "touch"] as const;
type Step = (typeof STEPS)[number];

const QUESTIONS: Record<Step, TextKey> = { size: "checkSize", input: "checkInput", free: "checkFree", touch: "checkTouch" };
const REMEDIES: Record<Step, TextKey> = { size: "fixSize", input: "fixInput", free: "fixFree", touch: "fixTouch" };

export class Setup {
  readonly element: HTMLElement;
  private readonly count = el("p", { class: "muted" });
  private readonly question = el("p", { class: "question" });
  private readonly reading = el("p", { class: "reading", attributes: { "aria-live": "off" } });
  private readonly remedy = el("p", { class: "fix", attributes: { hidden: "", role: "status" } });
  private steps: readonly Step[] = STEPS;
  private at = 0;
  private isOpen = false;

  constructor(
    private readonly model: Model,
    private readonly store: MeshStore,
    private readonly tip: TipState,
  ) {
    const yes = button("accept", "checkYes", () => this.next(), "primary");
    const no = button("reject", "checkNo", () => this.fail());
    const skip = button(null, "checkSkip", () => this.finish(), "ghost");
    this.element = el(
      "section",
      { class: "card setup", attributes: { "aria-labelledby": "setup-title", hidden: "" } },
      el("div", { class: "row" }, el("h2", { id: "setup-title", text: "setup" }), skip),
      this.count,
      this.question,
      this.reading,
      el("div", { class: "actions" }, yes, no),
      this.remedy,
    );
    model.on(["diagnostics"], () => this.read());
    onLanguage(() => this.isOpen && this.show());
  }

  /** Opens by itself for a scan without a check on this device. */
  meshCame(): void {
    if (!this.isOpen && this.scan !== null && settings.checkedScan !== this.scan && this.model.mayOperate) this.open(this.unasked);
  }

  open(steps: readonly Step[] = STEPS): void {
    this.steps = steps;
    this.at = 0;
    this.isOpen = true;
    this.element.hidden = false;
    this.show();
  }

  /** The tip or its force has changed. */
  read(): void {
    if (this.isOpen) write(this.reading, this.words());
  }

  private get scan(): string | null {
    const { state } = this.model;
    return state === null || this.store.version === 0 ? null : `${state.scan.file} ${state.scan.faces}`;
  }

  private get step(): Step {
    return this.steps[this.at];
  }

  /** The open questions: before there was a node, the setup asked for the size. */
  private get unasked(): readonly Step[] {
    const isSizeSaid = this.model.state?.scan.is_size_confirmed === true;
    return STEPS.filter((step) => step !== "size" || !isSizeSaid);
  }

  private show(): void {
    write(this.count, t("checkStep", { step: this.at + 1, all: this.steps.length }));
    if (this.step === "size") write(this.question, this.sizeQuestion());
    else say(this.question, QUESTIONS[this.step]);
    this.remedy.hidden = true;
    this.read();
  }

  private words(): string {
    switch (this.step) {
      case "size": return "";
      case "input": return this.model.input?.message ?? t("inputStale");
      case "free": return `${t("force")}: ${force(this.tip.force)}`;
      case "touch": {
        const { distance } = this.tip;
        const far = distance === null ? t("tipFar") : `${decimal(distance * 1e3, 2)}\u00a0mm`;
        return `${t("force")}: ${force(this.tip.force)} · ${t("toSurface")}: ${far}`;
      }
    }
  }

  private sizeQuestion(): string {
    const { low, high } = this.store;
    const sides = [0, 1, 2].map((axis) => high[axis] - low[axis]).sort((a, b) => b - a);
    const size = sides.map((side) => decimal(side * 1e3, side < 0.01 ? 1 : 0)).join(" × ");
    delete this.question.dataset.text;
    return t("checkSize", { size, thing: t(likeWhat(sides[0])) });
  }

  private next(): void {
    this.at++;
    if (this.at < this.steps.length) this.show();
    else this.finish();
  }

  private fail(): void {
    this.remedy.hidden = false;
    say(this.remedy, REMEDIES[this.step]);
  }

  private finish(): void {
    this.isOpen = false;
    this.element.hidden = true;
    if (this.scan !== null) keep({ checkedScan: this.scan });
  }
}
