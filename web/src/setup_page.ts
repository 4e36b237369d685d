/**
 * The page before there is a node: steps from a scan to the start, one at a time, as buttons that approve. The program keeps the choices,
 * so that every page shows the same; a page that may only look sees it too.
 */
import "./setup.css";
import { CallError } from "./connection";
import { el, say, write } from "./dom";
import { onLanguage, rewrite, t } from "./language";
import { settingsMenu } from "./settings_menu";
import { CheckStep } from "./setup_check";
import { ScanStep } from "./setup_scan";
import { StartStep } from "./setup_start";
import { askSetup, type SetupState, type SetupStepName } from "./setup_state";
import type { SetupDesk, SetupStep } from "./setup_step";
import { TipStep } from "./setup_tip";
import { UnitStep } from "./setup_unit";

/** Between two looks at the setup, ms: others change it too, and reading a scan takes its time. */
const LOOK = 700;

export function buildSetupPage(first: SetupState): void {
  let state = first;
  let opened: SetupStepName | null = null;
  let isWorking = false;
  const desk: SetupDesk = {
    get mayChange() {
      return state.role === "operate" && state.stage === "choosing" && !isWorking;
    },
    attempt,
    reopen: (step) => {
      opened = step;
      show();
      steps.find(({ name }) => name === step)?.focus();
    },
  };
  const steps: SetupStep[] = [new ScanStep(desk), new UnitStep(desk), new TipStep(desk), new CheckStep(desk), new StartStep(desk)];
  const role = el("span", { class: "pill plain" });
  const note = el("p", { class: "card note", attributes: { role: "status", hidden: "" } });
  const program = el("p", { class: "muted" });
  document.body.append(
    el("header", { class: "bar" }, el("h1", { class: "part", text: "getReady" }), role, el("div", { class: "choices" }, settingsMenu(() => {}))),
    el("main", { class: "setup-page" }, el("p", { class: "lead", text: "getReadyHow" }), note, ...steps.map(({ element }) => element), program),
  );
  onLanguage(show);
  show();
  rewrite(document.body);
  setTimeout(look, LOOK);

  /** The first that is not done; one that can mend why the node did not start comes before. */
  function current(): SetupStepName {
    const open = steps.find((step) => !step.isDone(state))?.name ?? "start";
    if (state.stage === "starting") return "start";
    const before = (name: SetupStepName): boolean => steps.findIndex((step) => step.name === name) <= steps.findIndex((step) => step.name === open);
    for (const wish of [opened, state.failure?.step ?? null]) if (wish !== null && before(wish)) return wish;
    return open;
  }

  function show(): void {
    const turn = current();
    for (const step of steps) step.show(state, turn);
    if (state.failure !== null) steps.find(({ name }) => name === turn)?.say(t("startRefused", { reason: state.failure.why }));
    say(role, state.role === "operate" ? "roleOperate" : "roleLook");
    write(program, state.program);
    tellNote(state.role === "look" ? t("whyLookOnly") : "");
  }

  function tellNote(words: string): void {
    note.hidden = words === "";
    write(note, words);
  }

  async function attempt(step: SetupStep, work: () => Promise<SetupState>): Promise<void> {
    if (isWorking) return;
    const before = current();
    isWorking = true;
    step.say("");
    show();
    let failed: string | null = null;
    try {
      state = await work();
      opened = null;
    } catch (error) {
      failed = wordsOf(error);
    }
    isWorking = false;
    show();
    if (failed !== null) step.say(failed);
    const now = current();
    if (now !== before) steps.find(({ name }) => name === now)?.focus();
  }

  async function look(): Promise<void> {
    const found = isWorking ? state : await askSetup();
    if (found === "running") return location.reload();
    if (found === null) tellNote(t("setupLost"));
    // an answer to a request before a change would undo the display
    else if (!isWorking && found !== state) take(found);
    setTimeout(look, LOOK);
  }

  function take(found: SetupState): void {
    const before = current();
    state = found;
    show();
    // the node has read the scan that this page chose
    const now = current();
    const isHere = document.activeElement === null || document.activeElement === document.body || steps.some(({ element }) => element.contains(document.activeElement));
    if (now !== before && isHere && desk.mayChange) steps.find(({ name }) => name === now)?.focus();
  }
}

function wordsOf(error: unknown): string {
  if (!(error instanceof CallError)) {
    console.error(error);
    return t("failedFault");
  }
  if (error.reason === "refused") return t("failedRefused", { reason: error.sentence ?? "" });
  return t(error.reason === "lost" ? "failedLost" : "failedLate");
}
