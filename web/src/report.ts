/** The inspection report of a session: asks for the values of `touchup inspect`'s flags, has the node make it, and shows the result. */
import { button, el, write } from "./dom";
import type { Inspection } from "./inspection";
import { t } from "./language";
import type { Session } from "./messages";
import type { Model } from "./model";
import { bytes } from "./numbers";
import type { Operating } from "./operating";
import { ReportFields } from "./report_fields";
import { asked, LARGEST, type ReportForm } from "./report_request";
import { fileAddress, reportAddress, reportSummary } from "./report_summary";
import { keep, settings } from "./settings";

export class Report {
  readonly element: HTMLDialogElement;
  private readonly title = el("h2", { id: "report-title" });
  private readonly fields = new ReportFields();
  private readonly status = el("p", { class: "reading", attributes: { role: "status" } });
  private readonly failure = el("p", { class: "fix", attributes: { role: "alert", hidden: "" } });
  private readonly result = el("div");
  private readonly form: HTMLElement;
  private session: Session | null = null;
  private isMaking = false;
  /** Number of requests for results. */
  private readings = 0;

  constructor(
    private readonly model: Model,
    private readonly operating: Operating,
    private readonly onMade: () => void,
  ) {
    const close = button("close", "close", () => this.element.close(), "ghost", true);
    const make = button("report", "reportMake", () => void this.make(), "primary");
    operating.guard(make, () => !this.isMaking);
    this.form = el("div", { class: "report-form" }, this.fields.element, el("div", { class: "row start" }, make));
    this.element = el(
      "dialog",
      { class: "dialog wide", attributes: { "aria-labelledby": "report-title" } },
      el("div", { class: "row" }, this.title, close),
      this.form,
      this.status,
      this.failure,
      this.result,
    );
  }

  async show(session: Session): Promise<void> {
    this.session = session;
    write(this.title, t("reportOf", { session: session.name }));
    this.fields.offer(session, this.model.state?.nominal_part ?? null, settings.operator);
    this.form.hidden = !this.model.mayOperate;
    this.failure.hidden = true;
    const hasResult = session.files.includes("results.json");
    const empty = hasResult ? "" : t("reportNone");
    write(this.status, !this.model.mayOperate ? empty : session.is_current ? t("reportSavesFirst") : "");
    this.result.replaceChildren();
    if (!this.element.open) this.element.showModal();
    if (hasResult) await this.showResult(session.name);
  }

  private async make(): Promise<void> {
    const { session } = this;
    if (session === null) return;
    const form = this.fields.read();
    const why = this.whyNot(form);
    if (why !== null) return this.fail(why);
    keep({ operator: form.operator });
    this.failure.hidden = true;
    this.wait(true);
    write(this.status, t(session.is_current ? "reportSaving" : "reportMaking"));
    this.readings++;
    this.result.replaceChildren();
    try {
      const address = `${reportAddress(session.name)}?${asked(form)}`;
      const answer = await fetch(address, { method: "POST", body: form.nominal === "upload" ? form.file : null });
      const said = (await answer.json()) as { was_saved: boolean } | { error: string };
      if ("error" in said) return this.fail(said.error);
      write(this.status, t(said.was_saved ? "reportMadeSaved" : "reportMade"));
      await this.showResult(session.name);
      this.onMade();
    } catch {
      this.fail(t("failedLost"));
    } finally {
      this.wait(false);
    }
  }

  /** The missing field, before any request. */
  private whyNot({ nominal, file }: ReportForm): string | null {
    if (nominal !== "upload") return null;
    if (file === null) return t("reportNoFile");
    return file.size > LARGEST ? t("reportTooLarge", { size: bytes(LARGEST) }) : null;
  }

  private wait(isMaking: boolean): void {
    this.isMaking = isMaking;
    this.operating.refresh();
  }

  private fail(why: string): void {
    write(this.status, "");
    this.failure.hidden = false;
    write(this.failure, why);
  }

  private async showResult(session: string): Promise<void> {
    const number = ++this.readings;
    const answer = await fetch(fileAddress(session, "results.json"));
    const inspection = answer.ok ? ((await answer.json()) as Inspection) : null;
    // a later request has replaced this one
    if (number !== this.readings) return;
    if (inspection === null) this.fail(t("reportUnread"));
    else this.result.replaceChildren(reportSummary(session, inspection));
  }
}
