/** After a tap on the part: the kind of feature to look for there. */
import { button, el } from "./dom";
import { FLAGGABLE, kindText } from "./feature_facts";
import { t } from "./language";
import type { Model } from "./model";
import type { Operating } from "./operating";
import type { TakeOut } from "./take_out";

/** Radius of a flag without a choice: the parameter flag_radius_mm. */
const AS_CONFIGURED = 0;

export class FlagMenu {
  readonly element = el("div", { class: "flag-menu", label: "flagHere", attributes: { role: "dialog", hidden: "" } });
  private place: [number, number, number] = [0, 0, 0];
  /** Called when it closes, so that the mark on the part goes. */
  onClose: () => void = () => {};

  constructor(
    private readonly model: Model,
    private readonly operating: Operating,
    private readonly takeOut: TakeOut,
  ) {
    const kinds = FLAGGABLE.map((kind) => operating.guard(button(null, kindText(kind), () => void this.flag(kind))));
    const close = button("close", "close", () => this.close(), "ghost", true);
    this.element.append(
      el("div", { class: "row" }, el("p", {}, el("strong", { text: "flagHere" })), close),
      el("p", { class: "muted", text: "flagHow" }),
      el("div", { class: "kinds" }, ...kinds),
      takeOut.element,
    );
    takeOut.onTaken = () => this.close();
    this.element.addEventListener("keydown", (event) => event.key === "Escape" && this.close());
  }

  /** @param place on the part, m. @param isTouched whether a touch supports it. @param x, y place of the menu, px in the picture. */
  open(place: [number, number, number], isTouched: boolean, x: number, y: number): void {
    this.place = place;
    if (isTouched) this.takeOut.look(place);
    this.element.hidden = false;
    const around = this.element.parentElement;
    const { offsetWidth, offsetHeight } = this.element;
    const left = Math.max(8, Math.min(x + 12, (around?.clientWidth ?? 0) - offsetWidth - 8));
    const top = Math.max(8, Math.min(y + 12, (around?.clientHeight ?? 0) - offsetHeight - 8));
    this.element.style.transform = `translate(${left}px, ${top}px)`;
    this.element.querySelector<HTMLButtonElement>(".kinds button")?.focus({ preventScroll: true });
  }

  close(): void {
    if (this.element.hidden) return;
    this.element.hidden = true;
    this.takeOut.forget();
    this.onClose();
  }

  private async flag(kind: number): Promise<void> {
    const [x, y, z] = this.place;
    this.close();
    const request = {
      kind,
      point: { header: { frame_id: this.model.frame }, point: { x, y, z } },
      search_radius: AS_CONFIGURED,
    };
    await this.operating.call("~/flag_feature", request, () => t("flagged", { kind: t(kindText(kind)) }));
  }
}
