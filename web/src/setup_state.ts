/**
 * The setup of a node, as the program has it: the choices of any operator up to now. The page asks for it and changes it over plain HTTP.
 */
import { CallError } from "./connection";

export interface SetupFile {
  name: string;
  bytes: number;
  /** s since 1970, null if the system does not say. */
  modified_s: number | null;
}

export interface UnitChoice {
  unit: "mm" | "m" | "inch";
  /** Along x, y, z of the scan, m. */
  sides_m: [number, number, number];
  is_plausible: boolean;
  is_likely: boolean;
}

export interface ScanFacts {
  file: string;
  faces: number;
  is_of_points: boolean;
  repair: {
    boundary_loops: number;
    components: number;
    non_manifold_edges: number;
    dropped_not_finite: number;
    dropped_zero_area: number;
    dropped_duplicates: number;
  };
  units: UnitChoice[];
}

export type ScanChoice =
  | { state: "none" }
  | { state: "reading"; file: string }
  | { state: "refused"; file: string; why: string }
  | ({ state: "read" } & ScanFacts);

/** A doubt about a recording, in the program's own sentences. */
export interface CheckFinding {
  cause: string;
  is_sure: boolean;
  measured: string;
  remedy: string;
}

export type CheckChoice =
  | { state: "none" }
  | { state: "running"; file: string }
  | { state: "refused"; file: string; why: string }
  | { state: "found"; file: string; findings: CheckFinding[]; losses: string[] };

export type CalibrationName = "tip" | "payload" | "scan";

/** A calibration of the scene, and the day of UTC of its entry if the scene says it. */
export interface NamedCalibration {
  is_there: boolean;
  date: string | null;
}

type Triple = [number, number, number];

/** Three numbers and their standard uncertainties. */
export interface VectorEstimate {
  value: Triple;
  std: Triple;
}

/** The result, as `touchup calibrate … --json` prints it. */
export interface TipFound {
  poses: number;
  left_out: number;
  swing_deg: number;
  offset_mm: VectorEstimate;
  residual_mm: number;
}

export interface PayloadFound {
  static_segments: number;
  left_out: number[];
  weight_n: number;
  weight_std_n: number;
  mass_kg: number;
  mass_std_kg: number;
  centre_mm: VectorEstimate;
  bias_force_n: VectorEstimate;
  residual_force_n: number;
  expected_residual_n: number | null;
}

export interface ScanFound {
  pairs: Array<{ name: string; distance_mm: number }>;
  rms_mm: number;
  scan_to_space: { position_mm: Triple };
  shift_std_mm: Triple;
  turn_std_deg: Triple;
}

/** A running or ended calibration; doubts and losses in the program's own sentences. */
export type CalibrationChoice =
  | { state: "none" }
  | { state: "running"; what: CalibrationName; file: string; share: number | null }
  | { state: "refused"; what: CalibrationName; file: string; why: string }
  | { state: "found"; what: CalibrationName; file: string; found: TipFound | PayloadFound | ScanFound; doubts: string[]; losses: string[]; is_used: boolean };

export type SetupStepName = "scan" | "unit" | "tip" | "check" | "start";

export interface SetupState {
  stage: "choosing" | "starting";
  role: "look" | "operate";
  program: string;
  folder: string;
  scene: string;
  files: SetupFile[];
  largest_upload: number;
  upload: { name: string; bytes: number; of: number | null } | null;
  scan: ScanChoice;
  unit: UnitChoice["unit"] | null;
  tip: { radius_mm: number; uncertainty_mm: number | null } | null;
  needs_radius: boolean;
  known_radius_mm: number | null;
  /** Which calibrations the scene has. */
  calibrations: Record<CalibrationName, NamedCalibration>;
  recordings: SetupFile[];
  /** Of points. */
  tables: SetupFile[];
  calibration: CalibrationChoice;
  check: CheckChoice;
  is_check_over: boolean;
  failure: { step: SetupStepName; why: string } | null;
}

const ADDRESS = "/api/setup";

/** The setup; "running" if there is a node, null without an answer or permission. */
export async function askSetup(): Promise<SetupState | "running" | null> {
  try {
    const answer = await fetch(ADDRESS, { cache: "no-store" });
    if (!answer.ok) return null;
    const found = (await answer.json()) as SetupState | { stage: "running" };
    return found.stage === "running" ? "running" : found;
  } catch {
    return null;
  }
}

/** Changes a part of the setup, or only looks; how it is then. */
export async function changeSetup(what: SetupStepName | "calibrate" | "use" | "look", request: object | null): Promise<SetupState> {
  let answer: Response;
  try {
    answer = await (what === "look" ? fetch(ADDRESS, { cache: "no-store" }) : fetch(`${ADDRESS}/${what}`, { method: "POST", body: JSON.stringify(request) }));
  } catch {
    throw new CallError("lost");
  }
  return answered<SetupState>(answer.ok, await answer.text());
}

/** Sends a scan, which becomes the choice; `onProgress` gets the sent share. */
export function sendScan(file: File, onProgress: (share: number) => void): Promise<SetupState> {
  return send("upload", file, onProgress);
}

/** Sends a recording or a table of points: the name that it has then. */
export async function sendFile(file: File, onProgress: (share: number) => void): Promise<string> {
  return (await send<{ file: string }>("file", file, onProgress)).file;
}

/** Only this kind of request tells how much has gone. */
function send<T>(where: string, file: File, onProgress: (share: number) => void): Promise<T> {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open("POST", `${ADDRESS}/${where}?name=${encodeURIComponent(file.name)}`);
    request.upload.onprogress = ({ loaded, total }) => total > 0 && onProgress(loaded / total);
    request.onerror = () => reject(new CallError("lost"));
    request.onload = () => {
      try {
        resolve(answered<T>(request.status === 200, request.responseText));
      } catch (error) {
        reject(error);
      }
    };
    request.send(file);
  });
}

function answered<T>(isGood: boolean, text: string): T {
  let found: T | { error: string };
  try {
    found = JSON.parse(text);
  } catch {
    throw new CallError("lost");
  }
  if (isGood) return found as T;
  throw new CallError("refused", (found as { error: string }).error);
}
