/** What the page asks of a report, as the address has it (docs/page.md). */

/** Bytes of a file that can be handed in; a table may have less. */
export const LARGEST = 64 * 2 ** 20;
/** What the node names its own nominal part, and those of the session, by. */
export type NominalFrom = "upload" | "part" | "nominal.csv" | "nominal.json";

export interface ReportForm {
  nominal: NominalFrom;
  file: File | null;
  /** Of a mesh that is handed in. */
  unit: string;
  /** "" where the drawing is in the frame of the scan. */
  align: string;
  /** "" where the drawing alone counts. */
  general: string;
  rule: string;
  /** In percent, as it was typed. */
  confidence: string;
  part: string;
  serial: string;
  operator: string;
}

/** Whether it is a CAD mesh, which has no tolerances and no unit. */
export function isMesh(name: string): boolean {
  return /\.(ply|stl|obj)$/i.test(name);
}

/** The query; what is empty is left out, so that the default of the program counts. */
export function asked(form: ReportForm): string {
  const { nominal, file } = form;
  const isUpload = nominal === "upload";
  const share = Number(form.confidence.trim().replace(",", ".")) / 100;
  const fields: Record<string, string> = {
    nominal: isUpload || nominal === "part" ? nominal : "session",
    file: isUpload ? (file?.name ?? "") : nominal === "part" ? "" : nominal,
    unit: isUpload && isMesh(file?.name ?? "") ? form.unit : "",
    align: form.align,
    general: form.general,
    rule: form.rule,
    confidence: form.confidence.trim() === "" ? "" : String(Number(share.toFixed(9))),
    part: form.part.trim(),
    serial: form.serial.trim(),
    operator: form.operator.trim(),
  };
  return new URLSearchParams(Object.entries(fields).filter(([, value]) => value !== "")).toString();
}
