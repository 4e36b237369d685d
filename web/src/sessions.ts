/** The sessions that the node keeps, with their files to take away. */
import { button, el, picture } from "./dom";
import { locale, t } from "./language";
import type { Session } from "./messages";
import type { Model } from "./model";
import type { Notices } from "./notices";
import { bytes } from "./numbers";
import type { Operating } from "./operating";
import { replayAddress } from "./replay_place";
import { Report } from "./report";
import { fileAddress } from "./report_summary";

export class Sessions {
  readonly element: HTMLDialogElement;
  readonly report: Report;
  private readonly list = el("div", { class: "sessions" });

  constructor(
    private readonly model: Model,
    operating: Operating,
    private readonly notices: Notices,
  ) {
    this.report = new Report(model, operating, () => void this.refresh());
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
    await this.refresh();
  }

  /** The report of the session that runs. */
  async showReport(): Promise<void> {
    const current = (await this.read())?.find((session) => session.is_current);
    if (current !== undefined) await this.report.show(current);
  }

  private async refresh(): Promise<void> {
    const found = await this.read();
    if (found === null) return this.element.close();
    this.list.replaceChildren(...found.map((session) => this.entry(session)));
    if (found.length === 0) this.list.replaceChildren(el("p", { text: "noSessions" }));
  }

  /** All of them; null after a failure, with a message. */
  private async read(): Promise<Session[] | null> {
    try {
      const answer = await fetch("/api/sessions");
      const found = (await answer.json()) as Session[] | { error: string };
      if (!Array.isArray(found)) throw new Error(found.error);
      return found;
    } catch (error) {
      this.notices.bad(`${t("failedSessions")} ${error instanceof TypeError ? "" : (error as Error).message}`);
      return null;
    }
  }

  private entry(session: Session): HTMLElement {
    const hasReport = session.files.includes("report.html");
    const report = button("report", "report", () => void this.report.show(session));
    report.hidden = !hasReport && !this.model.mayOperate;
    const replay = el("a", { class: "button", attributes: { href: replayAddress(session.name) } }, picture("play"), el("span", { text: "replay" }));
    return entry(session, replay, report);
  }
}

function entry(session: Session, ...actions: HTMLElement[]): HTMLElement {
  const begun = new Date(session.begun ?? "");
  const when = Number.isNaN(begun.valueOf())
    ? ""
    : new Intl.DateTimeFormat(locale(), { dateStyle: "medium", timeStyle: "short" }).format(begun);
  const facts = [when, bytes(session.bytes)].filter((fact) => fact !== "").join(" · ");
  const link = (file: string): HTMLElement => el("li", {}, el("a", { attributes: { href: fileAddress(session.name, file), download: file } }, file));
  const files = el("ul", { class: "files" }, ...session.files.map(link));
  const current = session.is_current ? el("span", { class: "pill plain", text: "current" }) : null;
  return el(
    "details",
    { class: "session" },
    el("summary", {}, el("strong", {}, session.name), " ", current, el("span", { class: "muted" }, facts)),
    el("div", { class: "row start" }, ...actions),
    session.files.length > 0 ? files : el("p", { class: "muted", text: "noFiles" }),
  );
}
