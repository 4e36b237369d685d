/**
 * Makes elements of the page in code, with texts by their keys: nothing on the page comes from a string of HTML.
 */
import { ICONS, type IconName } from "./icons";
import { label, t } from "./language";
import type { TextKey } from "./texts";

export interface Properties {
  class?: string;
  id?: string;
  /** Key of the text that it shows. */
  text?: TextKey;
  /** Key of its name, for an element without words. */
  label?: TextKey;
  attributes?: Record<string, string>;
  onClick?: () => void;
}

type Child = Node | string | null;

export function el<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Properties = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  if (properties.class !== undefined) element.className = properties.class;
  if (properties.id !== undefined) element.id = properties.id;
  if (properties.text !== undefined) say(element, properties.text);
  if (properties.label !== undefined) label(element, properties.label);
  for (const [name, value] of Object.entries(properties.attributes ?? {})) element.setAttribute(name, value);
  if (properties.onClick !== undefined) element.addEventListener("click", properties.onClick);
  element.append(...children.filter((child) => child !== null));
  return element;
}

/** Shows a text of the table, in whatever language is spoken. */
export function say(element: HTMLElement, key: TextKey): void {
  element.dataset.text = key;
  write(element, t(key));
}

/** Shows composed words; the same ones again touch nothing, so that a screen reader stays quiet. */
export function write(element: Element, words: string): void {
  if (element.textContent !== words) element.textContent = words;
}

/** A button with a picture and, unless it needs only its name, words. */
export function button(icon: IconName | null, text: TextKey, onClick: () => void, style = "", onlyIcon = false): HTMLButtonElement {
  const made = el("button", { class: `button ${style}`.trim(), attributes: { type: "button" }, onClick });
  if (icon !== null) made.append(picture(icon));
  if (onlyIcon) label(made, text);
  else made.append(el("span", { text }));
  return made;
}

const SVG = "http://www.w3.org/2000/svg";

export function svg(tag: string, attributes: Record<string, string | number>, ...children: Node[]): SVGElement {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  element.append(...children);
  return element;
}

/** A picture of the page's own, in the colour of the words around it. */
export function picture(name: IconName): SVGElement {
  const path = svg("path", { d: ICONS[name] });
  return svg("svg", { class: "icon", viewBox: "0 0 24 24", "aria-hidden": "true" }, path);
}

/** Asks before an irreversible action. */
export function ask(question: TextKey, yes: TextKey): Promise<boolean> {
  return new Promise((resolve) => {
    const dialog = el("dialog", { class: "dialog", attributes: { "aria-labelledby": "question" } });
    const answer = (result: boolean) => () => {
      dialog.close();
      resolve(result);
    };
    dialog.append(
      el("p", { id: "question", text: question }),
      el("div", { class: "row end" }, button(null, "no", answer(false)), button(null, yes, answer(true), "danger")),
    );
    dialog.addEventListener("cancel", () => resolve(false));
    dialog.addEventListener("close", () => dialog.remove());
    document.body.append(dialog);
    dialog.showModal();
  });
}
