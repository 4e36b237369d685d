/**
 * Hold to run: while somebody holds a button the page sends a beat each 20 ms, and the arm moves; without beats it stands within 200 ms.
 *
 * Every doubt about a hand on the button ends the beats: the finger goes up or gets lost, the key goes up, the window or the button loses
 * the focus, the page hides, the line breaks. It then needs a new press.
 */

/** ms. The node stops the arm after a silence of 120 ms: it survives the loss of four beats in a row. */
export const BEAT = 20;

export interface Hold {
  button: HTMLElement;
  /** Puts a beat onto the line; false when there is no line. */
  send: (beat: number) => boolean;
  /** Whether a press may begin now. */
  mayBegin: () => boolean;
  onChange: (isHeld: boolean) => void;
}

const KEYS = new Set([" ", "Enter"]);

export class HoldToRun {
  isHeld = false;
  private beat = 0;
  private timer: ReturnType<typeof setInterval> | undefined;
  private pointer: number | null = null;

  constructor(private readonly hold: Hold) {
    const { button } = hold;
    button.addEventListener("pointerdown", (event) => this.pointerDown(event));
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"] as const) {
      button.addEventListener(name, (event) => event.pointerId === this.pointer && this.end());
    }
    button.addEventListener("pointermove", (event) => event.pointerId === this.pointer && !this.isOver(event) && this.end());
    button.addEventListener("keydown", (event) => this.keyDown(event));
    button.addEventListener("keyup", (event) => KEYS.has(event.key) && this.end());
    button.addEventListener("blur", () => this.end());
    // a long press would else open a menu, and the page would lose the finger
    button.addEventListener("contextmenu", (event) => event.preventDefault());
    window.addEventListener("blur", () => this.end());
    window.addEventListener("pagehide", () => this.end());
    document.addEventListener("visibilitychange", () => document.visibilityState !== "visible" && this.end());
  }

  /** The hand is off, or may be. */
  end(): void {
    this.pointer = null;
    if (!this.isHeld) return;
    clearInterval(this.timer);
    this.isHeld = false;
    this.hold.onChange(false);
  }

  private pointerDown(event: PointerEvent): void {
    if (event.button !== 0 || this.isHeld) return;
    event.preventDefault();
    this.hold.button.focus();
    this.begin();
    if (!this.isHeld) return;
    this.pointer = event.pointerId;
    this.hold.button.setPointerCapture?.(event.pointerId);
  }

  private keyDown(event: KeyboardEvent): void {
    if (!KEYS.has(event.key)) return;
    event.preventDefault();
    if (!event.repeat) this.begin();
  }

  private begin(): void {
    if (this.isHeld || !this.hold.mayBegin() || document.visibilityState !== "visible") return;
    // the first beat goes before the order that it allows
    if (!this.hold.send(++this.beat)) return;
    this.isHeld = true;
    this.timer = setInterval(() => this.tick(), BEAT);
    this.hold.onChange(true);
  }

  private tick(): void {
    if (!this.hold.send(++this.beat)) this.end();
  }

  /** A finger that slid off the button holds nothing. */
  private isOver(event: PointerEvent): boolean {
    const { left, right, top, bottom } = this.hold.button.getBoundingClientRect();
    return event.clientX >= left && event.clientX <= right && event.clientY >= top && event.clientY <= bottom;
  }
}
