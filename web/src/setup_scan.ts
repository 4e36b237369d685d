/** The first step: a scan of the folder, or one that this device sends. */
import { button, el, write } from "./dom";
import { locale, t } from "./language";
import { bytes, percent } from "./numbers";
import { changeSetup, sendScan, type SetupFile, type SetupState } from "./setup_state";
import { refusalWords, type SetupDesk, SetupStep } from "./setup_step";

/** Files that a device offers. */
const ACCEPTED = ".ply,.stl,.obj,.pcd,.xyz,.txt,.asc,.e57";

export class ScanStep extends SetupStep {
  private readonly where = el("p", { class: "muted" });
  private readonly files = el("div", { class: "choices-list" });
  private readonly kinds = el("p", { class: "muted" });
  private readonly progress = el("progress", { attributes: { max: "1", hidden: "" } });
  private readonly status = el("p", { attributes: { role: "status" } });
  private readonly input = el("input", { label: "scanSend", attributes: { type: "file", accept: ACCEPTED, hidden: "" } });
  private readonly send: HTMLButtonElement;
  private shown = "";
  /** Sent share of this device's upload; null: none. */
  private sent: { file: string; share: number } | null = null;
  private state: SetupState | null = null;

  constructor(desk: SetupDesk) {
    super("scan", 1, "scanTitle", desk);
    this.send = button("share", "scanSend", () => this.input.click());
    this.input.addEventListener("change", () => void this.upload());
    this.body.append(
      el("p", { class: "question", text: "scanQuestion" }),
      this.where,
      this.files,
      el("div", { class: "actions" }, this.send, this.input),
      this.kinds,
      this.status,
      this.progress,
    );
  }

  isDone({ scan }: SetupState): boolean {
    return scan.state === "read";
  }

  protected words({ scan }: SetupState): string {
    return scan.state === "read" ? `${scan.file} · ${t("factFaces", { count: count(scan.faces) })}` : "";
  }

  protected draw(state: SetupState): void {
    this.state = state;
    const { folder, files, scan, largest_upload } = state;
    write(this.where, t(files.length > 0 ? "scanFolder" : "scanNone", { folder }));
    write(this.kinds, t("scanKinds", { size: bytes(largest_upload) }));
    const isBusy = scan.state === "reading" || state.upload !== null || this.sent !== null;
    const mayChange = this.desk.mayChange && !isBusy;
    // the same list again touches nothing, so that a focused button keeps the focus
    const drawn = JSON.stringify([files, locale()]);
    if (drawn !== this.shown) {
      this.shown = drawn;
      this.files.replaceChildren(...files.map((file) => this.entry(file)));
    }
    const chosen = scan.state === "none" ? null : scan.file;
    for (const each of this.files.querySelectorAll("button")) {
      each.disabled = !mayChange;
      each.setAttribute("aria-pressed", String(each.dataset.file === chosen));
    }
    this.send.disabled = !mayChange;
    this.tell(state);
  }

  private tell({ scan, upload }: SetupState): void {
    const sent = this.sent ?? (upload === null ? null : { file: upload.name, share: upload.of ? upload.bytes / upload.of : 0 });
    this.progress.hidden = sent === null;
    if (sent !== null) {
      const words = t("scanSending", { file: sent.file, share: percent(sent.share) });
      this.progress.value = sent.share;
      this.progress.setAttribute("aria-label", words);
      write(this.status, words);
    } else if (scan.state === "reading") write(this.status, t("scanReading", { file: scan.file }));
    else if (scan.state === "refused") write(this.status, refusalWords(scan.file, scan.why));
    else write(this.status, "");
    this.status.classList.toggle("fix", sent === null && scan.state === "refused");
  }

  private entry(file: SetupFile): HTMLElement {
    const when = file.modified_s === null ? "" : new Intl.DateTimeFormat(locale(), { dateStyle: "medium", timeStyle: "short" }).format(file.modified_s * 1000);
    const facts = [when, bytes(file.bytes)].filter((fact) => fact !== "").join(" · ");
    const made = el("button", { class: "button choice", attributes: { type: "button" } }, el("strong", {}, file.name), el("span", { class: "muted" }, facts));
    made.dataset.file = file.name;
    made.addEventListener("click", () => void this.desk.attempt(this, () => changeSetup("scan", { file: file.name })));
    return made;
  }

  private async upload(): Promise<void> {
    const file = this.input.files?.[0];
    // lets the user send the same file again
    this.input.value = "";
    if (file === undefined || this.state === null) return;
    const { largest_upload } = this.state;
    if (file.size > largest_upload) return this.say(t("scanTooLarge", { file: file.name, size: bytes(largest_upload) }));
    const note = (share: number): void => {
      this.sent = { file: file.name, share };
      if (this.state !== null) this.draw(this.state);
    };
    note(0);
    await this.desk.attempt(this, () => sendScan(file, note).finally(() => (this.sent = null)));
  }
}

/** "41 254", as the language has it. */
export function count(number: number): string {
  return new Intl.NumberFormat(locale()).format(number);
}
