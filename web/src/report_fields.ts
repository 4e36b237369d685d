/** The fields of a report: nominal values, general tolerance, rule, and the entries of its head. */
import { el } from "./dom";
import { onLanguage, t } from "./language";
import type { Session } from "./messages";
import { isMesh, type NominalFrom, type ReportForm } from "./report_request";
import type { TextKey } from "./texts";

const IN_SESSION = ["nominal.csv", "nominal.json"] as const;
const UNITS = ["mm", "m", "inch"];
const CLASSES: Array<[string, TextKey]> = [
  ["", "generalNone"], ["iso2768-f", "generalFine"], ["iso2768-m", "generalMedium"], ["iso2768-c", "generalCoarse"], ["iso2768-v", "generalVeryCoarse"],
];
/** Of a CAD mesh, until another choice. */
const FOR_MESHES = "iso2768-m";
/** Of the drawing to the part. */
const ALIGNMENTS: Array<[string, TextKey]> = [["", "alignNone"], ["best-fit", "alignBestFit"]];
const RULES: Array<[string, TextKey]> = [["iso14253", "ruleGuardBands"], ["simple", "ruleSimple"]];
/** Of the rule, percent: that of ISO 14253-1. */
const CONFIDENCE = "95";

export class ReportFields {
  readonly element: HTMLElement;
  private readonly nominal = el("select", { id: "report-nominal" });
  private readonly file = el("input", { id: "report-file", attributes: { type: "file", accept: ".csv,.json,.ply,.stl,.obj" } });
  private readonly unit = select("report-unit", UNITS.map((unit) => [unit, null]));
  private readonly align = select("report-align", ALIGNMENTS);
  private readonly general = select("report-general", CLASSES);
  private readonly rule = select("report-rule", RULES);
  private readonly confidence = text("report-confidence", CONFIDENCE);
  private readonly part = text("report-part");
  private readonly serial = text("report-serial");
  private readonly operator = text("report-operator");
  private readonly fileField = field("reportFile", this.file);
  private readonly unitField = field("reportUnit", this.unit);
  /** The general tolerance is the default for meshes, and no user's choice. */
  private isChosenHere = false;
  private offered: Array<[NominalFrom, string | null]> = [];

  constructor() {
    this.element = el(
      "div",
      { class: "fields" },
      field("reportNominal", this.nominal),
      this.fileField,
      this.unitField,
      field("reportAlign", this.align),
      field("reportGeneral", this.general),
      field("reportPart", this.part),
      field("reportSerial", this.serial),
      field("reportOperator", this.operator),
      field("reportRule", this.rule),
      field("reportConfidence", this.confidence),
    );
    for (const each of [this.nominal, this.file]) each.addEventListener("change", () => this.fit());
    this.general.addEventListener("change", () => (this.isChosenHere = false));
    onLanguage(() => this.write());
  }

  /** @param part file of the node's nominal part. */
  offer(session: Session, part: string | null, operator: string): void {
    const inSession = IN_SESSION.filter((name) => session.files.includes(name));
    this.offered = [
      ...inSession.map((name): [NominalFrom, string | null] => [name, name]),
      ...(part === null ? [] : [["part", part] as [NominalFrom, string | null]]),
      ["upload", null],
    ];
    this.nominal.replaceChildren(...this.offered.map(([value]) => el("option", { attributes: { value } })));
    this.file.value = "";
    if (this.operator.value === "") this.operator.value = operator;
    this.write();
    this.fit();
  }

  read(): ReportForm {
    return {
      nominal: this.nominal.value as NominalFrom,
      file: this.file.files?.[0] ?? null,
      unit: this.unit.value,
      align: this.align.value,
      general: this.general.value,
      rule: this.rule.value,
      confidence: this.confidence.value,
      part: this.part.value,
      serial: this.serial.value,
      operator: this.operator.value,
    };
  }

  private write(): void {
    this.offered.forEach(([value, name], at) => {
      const key: TextKey = value === "upload" ? "nominalUpload" : value === "part" ? "nominalPart" : "nominalInSession";
      this.nominal.options[at].textContent = t(key, { file: name ?? "" });
    });
  }

  /** A CAD mesh has no tolerances of its own: it gets a general one, which the user may replace, but not remove. */
  private fit(): void {
    const { nominal, file } = this.read();
    const isUpload = nominal === "upload";
    const isUploadedMesh = isUpload && isMesh(file?.name ?? "");
    const needsGeneral = nominal === "part" || isUploadedMesh;
    this.fileField.hidden = !isUpload;
    this.unitField.hidden = !isUploadedMesh;
    this.general.options[0].disabled = needsGeneral;
    if (needsGeneral && this.general.value === "") {
      this.general.value = FOR_MESHES;
      this.isChosenHere = true;
    } else if (!needsGeneral && this.isChosenHere) {
      this.general.value = "";
      this.isChosenHere = false;
    }
  }
}

function field(label: TextKey, control: HTMLElement): HTMLElement {
  return el("div", { class: "field" }, el("label", { text: label, attributes: { for: control.id } }), control);
}

function text(id: string, value = ""): HTMLInputElement {
  const made = el("input", { id, attributes: { type: "text", maxlength: "200", autocomplete: "off" } });
  made.value = value;
  return made;
}

function select(id: string, options: Array<[string, TextKey | null]>): HTMLSelectElement {
  const option = ([value, key]: [string, TextKey | null]): HTMLElement =>
    key === null ? el("option", { attributes: { value } }, value) : el("option", { text: key, attributes: { value } });
  return el("select", { id }, ...options.map(option));
}
