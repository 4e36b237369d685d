/** Language and theme, behind one button. */
import { button, el } from "./dom";
import { language, speak } from "./language";
import { keep, settings, type Settings } from "./settings";
import { LANGUAGE_NAMES, LANGUAGES, type Language, type TextKey } from "./texts";

const THEMES: Record<Settings["theme"], TextKey> = { auto: "themeAuto", light: "themeLight", dark: "themeDark" };

export function settingsMenu(onTheme: () => void): HTMLElement {
  const row = (text: TextKey, id: string, choice: HTMLSelectElement): HTMLElement => {
    choice.id = id;
    return el("div", { class: "field" }, el("label", { text, attributes: { for: id } }), choice);
  };
  const popover = el(
    "div",
    { class: "popover", attributes: { hidden: "" } },
    row("language", "language", languages()),
    row("theme", "theme", themes(onTheme)),
  );
  const open = button("menu", "settings", () => show(popover.hidden), "square", true);
  const show = (isShown: boolean): void => {
    popover.hidden = !isShown;
    open.setAttribute("aria-expanded", String(isShown));
  };
  show(false);
  const all = el("div", { class: "settings" }, open, popover);
  all.addEventListener("keydown", (event) => event.key === "Escape" && show(false));
  document.addEventListener("pointerdown", (event) => all.contains(event.target as Node) || show(false));
  return all;
}

function languages(): HTMLSelectElement {
  const choice = el("select");
  for (const name of LANGUAGES) choice.append(el("option", { attributes: { value: name, lang: name } }, LANGUAGE_NAMES[name]));
  choice.value = language();
  choice.addEventListener("change", () => speak(choice.value as Language));
  return choice;
}

function themes(onTheme: () => void): HTMLSelectElement {
  const choice = el("select");
  for (const [name, text] of Object.entries(THEMES)) choice.append(el("option", { text, attributes: { value: name } }));
  choice.value = settings.theme;
  choice.addEventListener("change", () => {
    keep({ theme: choice.value as Settings["theme"] });
    applyTheme();
    onTheme();
  });
  return choice;
}

const DEVICE_IS_DARK = matchMedia("(prefers-color-scheme: dark)");

/** Before anything asks the style sheet for a colour, and again whenever the device changes its own. */
export function followTheme(): void {
  applyTheme();
  DEVICE_IS_DARK.addEventListener("change", applyTheme);
}

function applyTheme(): void {
  const { theme } = settings;
  document.documentElement.dataset.theme = theme === "auto" ? (DEVICE_IS_DARK.matches ? "dark" : "light") : theme;
}
