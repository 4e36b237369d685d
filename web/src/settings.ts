/** Settings that the page remembers on this device: language, theme, colours, tolerance. If the browser forbids it, it forgets. */

const KEY = "touchup";

export interface Settings {
  language: string;
  theme: "auto" | "light" | "dark";
  colourBy: string;
  /** Wanted expanded uncertainty, m. */
  tolerance: number;
  showsAll: boolean;
  /** Scan with a check of size and place on this device. */
  checkedScan: string;
  /** Who made the last report here. */
  operator: string;
}

const DEFAULTS: Settings = { language: "", theme: "auto", colourBy: "support", tolerance: 0.02e-3, showsAll: false, checkedScan: "", operator: "" };

export const settings: Settings = read();

export function keep(changed: Partial<Settings>): void {
  Object.assign(settings, changed);
  try {
    localStorage.setItem(KEY, JSON.stringify(settings));
  } catch {
    // forbidden: then it lasts as long as the page
  }
}

/** The stored settings, each only if it has the type of its default. */
function read(): Settings {
  let kept: unknown = null;
  try {
    kept = JSON.parse(localStorage.getItem(KEY) ?? "null");
  } catch {
    // forbidden, or not ours
  }
  const found: Record<string, unknown> = { ...DEFAULTS };
  if (typeof kept === "object" && kept !== null) {
    for (const [name, value] of Object.entries(kept)) {
      if (name in found && typeof value === typeof found[name]) found[name] = value;
    }
  }
  return found as unknown as Settings;
}
