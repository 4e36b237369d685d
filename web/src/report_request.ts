/** The page's request of a report, in the form of the address (docs/page.md). */

/** Largest size of an uploaded file, bytes; a table may have less. */
export const LARGEST = 64 * 2 ** 20;
/** Names of the node for its own nominal part, and for those of the session. */
export type NominalFrom = "upload" | "part" | "nominal.csv" | "nominal.json";

export interface ReportForm {
  nominal: NominalFrom;
  file: File | null;
  /** Of an uploaded mesh. */
  unit: string;
  /** "" for a drawing in the frame of the scan. */
  align: string;
  /** "" for the drawing alone. */
  general: string;
  rule: string;
  /** In percent, as typed. */
  confidence: string;
  part: string;
  serial: string;
  operator: string;
}

/** Whether it is a CAD mesh, which has no tolerances and no unit. */
export function isMesh(name: string): boolean {
  return /\.(ply|stl|obj)$/i.test(name);
}

/** The query; without empty fields, so that the default of the program counts. */
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
