/** Lets another device in: a link that is good for one device, to look or to operate. */
import { codePicture } from "./code_picture";
import { button, el } from "./dom";
import type { Operating } from "./operating";

interface Invitation {
  link: string;
  /** QR code of the link, row by row: 1 for a dark module. */
  code: string[];
}

export class Share {
  readonly element: HTMLDialogElement;
  private readonly code = el("div", { class: "code" });
  private readonly link = el("output", { class: "link", attributes: { tabindex: "0", hidden: "" } });

  constructor(private readonly operating: Operating) {
    const close = button("close", "close", () => this.element.close(), "ghost", true);
    const look = button(null, "shareLook", () => void this.make("look"));
    const operate = button(null, "shareOperate", () => void this.make("operate"));
    this.element = el(
      "dialog",
      { class: "dialog wide", attributes: { "aria-labelledby": "share-title" } },
      el("div", { class: "row" }, el("h2", { id: "share-title", text: "share" }), close),
      el("p", { class: "muted", text: "shareHow" }),
      el("div", { class: "actions" }, operating.guard(look), operating.guard(operate)),
      this.code,
      this.link,
    );
  }

  show(): void {
    this.link.hidden = true;
    this.code.replaceChildren();
    this.element.showModal();
  }

  private async make(role: "look" | "operate"): Promise<void> {
    try {
      const { link, code } = await this.operating.connection.call<Invitation>("~/invite", { role });
      this.code.replaceChildren(codePicture(code));
      this.link.hidden = false;
      this.link.textContent = link;
      // selected, so that one gesture copies it: a page without TLS has no clipboard
      getSelection()?.selectAllChildren(this.link);
    } catch (error) {
      this.element.close();
      this.operating.notices.failed(error);
    }
  }
}
