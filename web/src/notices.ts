/** Short notices at the edge of the picture: successes, and failures with the node's own sentence. A screen reader reads them aloud. */
import { CallError } from "./connection";
import { button, el } from "./dom";
import { t } from "./language";
import type { TextKey } from "./texts";

/** How long a notice stays, ms; one about an error stays longer, one with something to do longest. */
const STAYS = { good: 4000, bad: 12_000, offer: 60_000 };
/** Largest number at once. */
const MOST = 3;

export class Notices {
  readonly element = el("div", { class: "notices", attributes: { role: "status", "aria-live": "polite" } });

  good(words: string): void {
    this.tell(words, "good");
  }

  /** With a button for its remedy, once. */
  offer(words: string, name: TextKey, action: () => void): void {
    const notice = this.tell(words, "good", STAYS.offer);
    const act = button("undo", name, () => {
      notice.remove();
      action();
    });
    notice.lastElementChild?.before(act);
  }

  bad(words: string): void {
    this.tell(words, "bad");
  }

  failed(error: unknown): void {
    if (!(error instanceof CallError)) {
      console.error(error);
      return this.bad(t("failedFault"));
    }
    if (error.reason === "refused") return this.refused(error.sentence ?? "");
    this.bad(t(error.reason === "lost" ? "failedLost" : "failedLate"));
  }

  /** @param reason the node's own sentence. */
  refused(reason: string): void {
    this.bad(t("failedRefused", { reason }));
  }

  private tell(words: string, kind: "good" | "bad", stays = STAYS[kind]): HTMLElement {
    const close = el("button", { class: "button ghost small", label: "close", attributes: { type: "button" } }, "×");
    const notice = el("div", { class: `notice ${kind}` }, el("span", {}, words), close);
    close.addEventListener("click", () => notice.remove());
    this.element.append(notice);
    while (this.element.childElementCount > MOST) this.element.firstElementChild?.remove();
    setTimeout(() => notice.remove(), stays);
    return notice;
  }
}
