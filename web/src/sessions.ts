/** The sessions that are kept beside the node, with their files to take away. */
import { button, el } from "./dom";
import { locale, t } from "./language";
import type { Session } from "./messages";
import type { Notices } from "./notices";
import { bytes } from "./numbers";

export class Sessions {
  readonly element: HTMLDialogElement;
  private readonly list = el("div", { class: "sessions" });

  constructor(private readonly notices: Notices) {
    const close = button("close", "close", () => this.element.close(), "ghost", true);
    this.element = el(
      "dialog",
      { class: "dialog wide", attributes: { "aria-labelledby": "sessions-title" } },
      el("div", { class: "row" }, el("h2", { id: "sessions-title", text: "sessions" }), close),
      this.list,
    );
  }

  async show(): Promise<void> {
    this.list.replaceChildren(el("p", { text: "loading" }));
    if (!this.element.open) this.element.showModal();
    try {
      const answer = await fetch("/api/sessions");
      const found = (await answer.json()) as Session[] | { error: string };
      if (!Array.isArray(found)) throw new Error(found.error);
      this.list.replaceChildren(...found.map(entry));
      if (found.length === 0) this.list.replaceChildren(el("p", { text: "noSessions" }));
    } catch (error) {
      this.element.close();
      this.notices.bad(`${t("failedSessions")} ${error instanceof TypeError ? "" : (error as Error).message}`);
    }
  }
}

function entry(session: Session): HTMLElement {
  const begun = new Date(session.begun ?? "");
  const when = Number.isNaN(begun.valueOf())
    ? ""
    : new Intl.DateTimeFormat(locale(), { dateStyle: "medium", timeStyle: "short" }).format(begun);
  const facts = [when, bytes(session.bytes)].filter((fact) => fact !== "").join(" · ");
  const link = (file: string): HTMLElement => {
    const href = `/api/sessions/${encodeURIComponent(session.name)}/${encodeURIComponent(file)}`;
    return el("li", {}, el("a", { attributes: { href, download: file } }, file));
  };
  const files = el("ul", { class: "files" }, ...session.files.map(link));
  const current = session.is_current ? el("span", { class: "pill plain", text: "current" }) : null;
  return el(
    "details",
    { class: "session" },
    el("summary", {}, el("strong", {}, session.name), " ", current, el("span", { class: "muted" }, facts)),
    session.files.length > 0 ? files : el("p", { class: "muted", text: "noFiles" }),
  );
}
