/**
 * The bar at the top: part and session, state of the line, use of the sensors' data with its remedy, role of the page, language and theme.
 */
import { button, el, say, write } from "./dom";
import { onLanguage, t } from "./language";
import type { Model } from "./model";
import { settingsMenu } from "./settings_menu";
import type { TextKey } from "./texts";

const INPUT_TEXTS: TextKey[] = ["inputGood", "inputDoubtful", "inputWrong", "inputStale"];
/** A shorter disturbance, in messages of one each second, does not push the picture down. */
const ENDURED = 3;

export class StatusBar {
  readonly element: HTMLElement;
  private readonly part = el("h1", { class: "part" });
  private readonly line = el("p", { class: "pill", attributes: { role: "status" } });
  private readonly input = el("span", { class: "pill" });
  private readonly role = el("span", { class: "pill plain" });
  /** Messages in a row that said something is wrong. */
  private badSince = 0;
  /** The node's words on its input, under the bar while it is not good. */
  readonly remedy = el("div", { class: "remedy", attributes: { role: "status" } });

  constructor(
    private readonly model: Model,
    onTheme: () => void,
    onSetup: () => void,
    onShare: () => void,
  ) {
    const setup = button("check", "setupOpen", onSetup, "square", true);
    const share = button("share", "share", onShare, "square", true);
    // a replay has no setup and no links to share
    setup.hidden = share.hidden = model.replayed !== null;
    const right = el("div", { class: "choices" }, setup, share, settingsMenu(onTheme));
    this.element = el("header", { class: "bar" }, this.part, this.line, this.input, this.role, right);
    model.on(["diagnostics"], () => (this.badSince = (model.input?.level ?? 0) > 0 ? this.badSince + 1 : 0));
    model.on(["state", "line", "diagnostics"], () => this.show());
    onLanguage(() => this.show());
    this.show();
  }

  private show(): void {
    const { state, line, input } = this.model;
    write(this.part, state === null ? t("appName") : `${state.scan.file} · ${state.session}`);
    const words = { connecting: t("lineConnecting"), connected: t("lineConnected"), ended: t("lineEnded"), waiting: "" };
    write(this.line, line.kind === "waiting" ? t("lineWaiting", { seconds: line.seconds }) : words[line.kind]);
    this.line.dataset.level = line.kind === "connected" ? "good" : "bad";
    const level = state?.is_paused ? -1 : (input?.level ?? -2);
    this.input.hidden = line.kind !== "connected" || level === -2;
    write(this.input, level === -1 ? t("inputPaused") : level >= 0 ? t(INPUT_TEXTS[level] ?? "inputStale") : "");
    this.input.dataset.level = level === 0 ? "good" : level === 2 ? "bad" : "warn";
    this.role.hidden = state === null;
    if (this.model.replayed !== null) say(this.role, "replayRole");
    else if (state !== null) say(this.role, state.role === "operate" ? "roleOperate" : "roleLook");
    this.remedy.hidden = this.badSince < ENDURED || !(level > 0) || line.kind !== "connected";
    if (!this.remedy.hidden) this.remedy.replaceChildren(el("strong", {}, `${this.input.textContent}: `), input?.message ?? "");
  }
}
