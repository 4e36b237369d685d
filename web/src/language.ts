/**
 * The language of the page: first the browser's choice, then the user's, which it remembers; and the way of a text from the table onto the
 * page.
 *
 * Elements that only show a text carry its key (`data-text`, `data-label`) and follow a change of the language; listeners draw texts with
 * numbers again.
 */
import { keep, settings } from "./settings";
import { LANGUAGES, type Language, type TextKey, texts } from "./texts";

let current: Language = chosen();
const listeners: Array<() => void> = [];

function chosen(): Language {
  const wishes = [settings.language, ...(typeof navigator === "undefined" ? [] : navigator.languages)];
  for (const wish of wishes) {
    const found = LANGUAGES.find((language) => language === wish.slice(0, 2).toLowerCase());
    if (found !== undefined) return found;
  }
  return "en";
}

export function language(): Language {
  return current;
}

/** For Intl: with its decimal sign. English with the point, as on drawings. */
export function locale(): string {
  return { en: "en-GB", de: "de-DE", es: "es-ES" }[current];
}

/** A text of the table; the value of that name replaces `{name}` in it. */
export function t(key: TextKey, values: Record<string, string | number> = {}): string {
  const text = texts[key][LANGUAGES.indexOf(current)];
  return text.replace(/\{(\w+)\}/g, (whole, name: string) => String(values[name] ?? whole));
}

export function speak(language: Language): void {
  current = language;
  keep({ language });
  rewrite(document);
  for (const listener of listeners) listener();
}

/** Called when the language changed. */
export function onLanguage(listener: () => void): void {
  listeners.push(listener);
}

/** Writes the texts of all elements that carry keys. */
export function rewrite(root: Document | HTMLElement): void {
  document.documentElement.lang = current;
  for (const element of root.querySelectorAll<HTMLElement>("[data-text]")) {
    element.textContent = t(element.dataset.text as TextKey);
  }
  for (const element of root.querySelectorAll<HTMLElement>("[data-label]")) label(element, element.dataset.label as TextKey);
}

/** The name of an element without visible words; a pointer that rests on it shows it too. */
export function label(element: HTMLElement, key: TextKey): void {
  element.dataset.label = key;
  element.setAttribute("aria-label", t(key));
  element.title = t(key);
}
