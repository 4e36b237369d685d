/**
 * The bar at the top: which part and session, whether the line stands, whether what comes from the sensors is used and what to do
 * if not, who looks and who operates, language and theme.
 */
import { el, say, write } from "./dom";
import { language, onLanguage, speak, t } from "./language";
import type { Model } from "./model";
import { keep, settings, type Settings } from "./settings";
import { LANGUAGE_NAMES, LANGUAGES, type Language, type TextKey } from "./texts";

const INPUT_TEXTS: TextKey[] = ["inputGood", "inputDoubtful", "inputWrong", "inputStale"];
const THEMES: Record<Settings["theme"], TextKey> = { auto: "themeAuto", light: "themeLight", dark: "themeDark" };

export class StatusBar {
  readonly element: HTMLElement;
  private readonly part = el("h1", { class: "part" });
  private readonly line = el("p", { class: "pill", attributes: { role: "status" } });
  private readonly input = el("span", { class: "pill" });
  private readonly role = el("span", { class: "pill plain" });
  /** What the node says about its input, under the bar while it is not good. */
  readonly remedy = el("div", { class: "remedy", attributes: { role: "status" } });

  constructor(
    private readonly model: Model,
    private readonly onTheme: () => void,
  ) {
    const settingsRow = el("div", { class: "choices" }, this.languages(), this.themes());
    this.element = el("header", { class: "bar" }, this.part, this.line, this.input, this.role, settingsRow);
    model.on(["state", "line", "diagnostics"], () => this.show());
    onLanguage(() => this.show());
    this.show();
    applyTheme();
  }

  private show(): void {
    const { state, line, input } = this.model;
    write(this.part, state === null ? t("appName") : `${state.scan.file} · ${state.session}`);
    const words = { connecting: t("lineConnecting"), connected: t("lineConnected"), waiting: "" };
    write(this.line, line.kind === "waiting" ? t("lineWaiting", { seconds: line.seconds }) : words[line.kind]);
    this.line.dataset.level = line.kind === "connected" ? "good" : "bad";
    const level = state?.is_paused ? -1 : (input?.level ?? -2);
    this.input.hidden = line.kind !== "connected" || level === -2;
    write(this.input, level === -1 ? t("inputPaused") : level >= 0 ? t(INPUT_TEXTS[level] ?? "inputStale") : "");
    this.input.dataset.level = level === 0 ? "good" : level === 2 ? "bad" : "warn";
    this.role.hidden = state === null;
    if (state !== null) say(this.role, state.role === "operate" ? "roleOperate" : "roleLook");
    this.remedy.hidden = !(level > 0) || line.kind !== "connected";
    if (!this.remedy.hidden) this.remedy.replaceChildren(el("strong", {}, `${this.input.textContent}: `), input?.message ?? "");
  }

  private languages(): HTMLElement {
    const choice = el("select", { label: "language" });
    for (const name of LANGUAGES) choice.append(el("option", { attributes: { value: name, lang: name } }, LANGUAGE_NAMES[name]));
    choice.value = language();
    choice.addEventListener("change", () => speak(choice.value as Language));
    return choice;
  }

  private themes(): HTMLElement {
    const choice = el("select", { label: "theme" });
    for (const [name, text] of Object.entries(THEMES)) choice.append(el("option", { text, attributes: { value: name } }));
    choice.value = settings.theme;
    choice.addEventListener("change", () => {
      keep({ theme: choice.value as Settings["theme"] });
      applyTheme();
      this.onTheme();
    });
    return choice;
  }
}

function applyTheme(): void {
  document.documentElement.dataset.theme = settings.theme;
}
