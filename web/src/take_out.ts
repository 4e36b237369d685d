/** After a tap on a touched place: the touch behind it appears as a line; the user can take it out, and put it back again. */
import { button, el, write } from "./dom";
import { onLanguage, t } from "./language";
import type { Xyz } from "./messages";
import type { Model } from "./model";
import type { Operating } from "./operating";
import type { TextKey } from "./texts";
import { type FoundTouch, type Place, putBackRequest, takeOutRequest, TouchChoice } from "./touch_choice";

const SERVICE = "~/take_out_touch";
/** The node makes all other touches again, which takes a while after a long day, ms. */
const WITHIN = 300_000;

export class TakeOut {
  /** Stands in the menu of a place. */
  readonly element = el("div", { class: "take-out", attributes: { hidden: "" } });
  private readonly words = el("p", { class: "muted" });
  private readonly choice: TouchChoice;
  /** Called after a removal, so that the menu goes. */
  onTaken: () => void = () => {};

  /** @param showLine draws a touch; nothing for none. */
  constructor(
    private readonly model: Model,
    private readonly operating: Operating,
    private readonly showLine: (contacts: Xyz[]) => void,
  ) {
    this.choice = new TouchChoice((request) => operating.connection.call<FoundTouch>(SERVICE, request), () => this.show());
    this.element.append(this.words, operating.guard(button("takeOut", "takeOutTouch", () => void this.takeOut(), "danger")));
    onLanguage(() => this.show());
  }

  /** Looks for the touch at a place of the part, m. */
  look(place: Place): void {
    if (!this.model.mayOperate) return;
    // without a touch there is no offer; the status bar shows the connection
    this.choice.look(place, this.model.frame).catch(() => this.choice.forget());
  }

  forget(): void {
    this.choice.forget();
  }

  private show(): void {
    const { chosen } = this.choice;
    this.element.hidden = chosen === null;
    write(this.words, chosen === null ? "" : t("touchHere", { contacts: String(chosen.contacts) }));
    this.showLine(chosen?.points ?? []);
  }

  private async takeOut(): Promise<void> {
    const { chosen } = this.choice;
    if (chosen === null) return;
    this.onTaken();
    const session = this.model.state?.session;
    const out = await this.change(takeOutRequest(chosen), "touchTakingOut");
    if (out === null) return;
    this.operating.notices.offer(t("touchTakenOut"), "putBack", () => {
      if (session === this.model.state?.session) void this.putBack(out);
    });
  }

  private async putBack(touch: FoundTouch): Promise<void> {
    if ((await this.change(putBackRequest(touch), "touchPuttingBack")) !== null) this.operating.notices.good(t("touchPutBack"));
  }

  private change(request: object, doing: TextKey): Promise<FoundTouch | null> {
    this.operating.notices.good(t(doing));
    return this.operating.call<FoundTouch>(SERVICE, request, undefined, WITHIN);
  }
}
