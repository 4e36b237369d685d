/**
 * Calls that change something: only with the role "operate" and a line; else the buttons rest, and say why.
 */
import type { Connection } from "./connection";
import { onLanguage, t } from "./language";
import type { Answer } from "./messages";
import type { Model } from "./model";
import type { Notices } from "./notices";

export class Operating {
  private readonly buttons = new Map<HTMLButtonElement | HTMLInputElement | HTMLSelectElement, () => boolean>();

  constructor(
    readonly connection: Connection,
    private readonly model: Model,
    readonly notices: Notices,
  ) {
    model.on(["state", "line", "features", "selected"], () => this.refresh());
    onLanguage(() => this.refresh());
  }

  /** A control that changes something. @param isUseful false: it has nothing to do now. */
  guard<T extends HTMLButtonElement | HTMLInputElement | HTMLSelectElement>(control: T, isUseful = (): boolean => true): T {
    this.buttons.set(control, isUseful);
    this.refreshOne(control, isUseful);
    return control;
  }

  /** Calls a service that answers success and message; tells how it went. @param within ms. @returns the answer, null when it failed. */
  async call<T extends Answer>(service: string, request: object = {}, done?: (answer: T) => string, within?: number): Promise<T | null> {
    try {
      const answer = await this.connection.call<T>(service, request, within);
      if (answer.success) {
        if (done !== undefined) this.notices.good(done(answer));
        return answer;
      }
      this.notices.refused(answer.message);
    } catch (error) {
      this.notices.failed(error);
    }
    return null;
  }

  /** Reason against operating here; null without one. */
  reason(): string | null {
    if (!this.model.isConnected) return t("whyNoLine");
    if (this.model.replayed !== null) return t("whyReplay");
    return this.model.mayOperate ? null : t("whyLookOnly");
  }

  refresh(): void {
    for (const [control, isUseful] of this.buttons) {
      this.refreshOne(control, isUseful);
    }
  }

  private refreshOne(control: HTMLButtonElement | HTMLInputElement | HTMLSelectElement, isUseful: () => boolean): void {
    const reason = this.reason();
    control.disabled = reason !== null || !isUseful();
    if (reason !== null) control.title = reason;
    else if (control.dataset.label !== undefined) control.title = control.getAttribute("aria-label") ?? "";
    else control.removeAttribute("title");
  }
}
