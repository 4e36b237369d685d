/** One step of the setup: a card with its number and title, open during its turn, one line afterwards. */
import { button, el, write } from "./dom";
import { t } from "./language";
import type { SetupState, SetupStepName } from "./setup_state";
import type { TextKey } from "./texts";

/** Requests of the steps to the page around them. */
export interface SetupDesk {
  /** Whether this page may change something now. */
  readonly mayChange: boolean;
  /** Does the work; the step shows its failure. */
  attempt(step: SetupStep, work: () => Promise<SetupState>): Promise<void>;
  /** Opens a finished step again. */
  reopen(step: SetupStepName): void;
}

export abstract class SetupStep {
  readonly element: HTMLElement;
  protected readonly body = el("div", { class: "step-body" });
  private readonly heading: HTMLElement;
  private readonly summary = el("p", { class: "step-summary" });
  private readonly fault = el("p", { class: "fix", attributes: { role: "alert", hidden: "" } });
  private readonly change: HTMLButtonElement;

  constructor(
    readonly name: SetupStepName,
    number: number,
    private readonly title: TextKey,
    protected readonly desk: SetupDesk,
  ) {
    const id = `step-${name}`;
    this.heading = el("h2", { id, attributes: { tabindex: "-1" } }, el("span", { class: "step-number" }, `${number}`), el("span", { text: title }));
    this.change = button("back", "stepChangeWord", () => desk.reopen(name), "ghost");
    this.element = el(
      "section",
      { class: "card step", attributes: { "aria-labelledby": id } },
      el("div", { class: "row" }, this.heading, this.change),
      this.summary,
      this.body,
      this.fault,
    );
  }

  /** Whether the step is finished. */
  abstract isDone(state: SetupState): boolean;
  /** The choice, in one line. */
  protected abstract words(state: SetupState): string;
  protected abstract draw(state: SetupState): void;

  show(state: SetupState, current: SetupStepName): void {
    const isCurrent = current === this.name;
    const isDone = this.isDone(state) && !isCurrent;
    this.element.dataset.turn = isCurrent ? "now" : isDone ? "done" : "later";
    if (isCurrent) this.element.setAttribute("aria-current", "step");
    else this.element.removeAttribute("aria-current");
    this.body.hidden = !isCurrent;
    this.summary.hidden = !isDone;
    write(this.summary, isDone ? this.words(state) : "");
    this.change.hidden = !isDone || !this.desk.mayChange;
    const words = t("stepChange", { step: t(this.title) });
    this.change.setAttribute("aria-label", words);
    this.change.title = words;
    if (!isCurrent) this.say("");
    if (isCurrent) this.draw(state);
  }

  /** Shows a failure; empty: none. */
  say(words: string): void {
    this.fault.hidden = words === "";
    write(this.fault, words);
  }

  /** Brings a reader of the page here. */
  focus(): void {
    this.heading.focus({ preventScroll: true });
    this.element.scrollIntoView({ block: "nearest" });
  }
}

/** Refusal of a file with its reason; reasons of the program may name the file themselves. */
export function refusalWords(file: string, why: string): string {
  const named = `${file}: `;
  return t("scanRefused", { file, reason: why.startsWith(named) ? why.slice(named.length) : why });
}
