/** The setup of a node, as the program has it: what was chosen so far, by whoever operates. Asked for and changed over plain HTTP. */
import { CallError } from "./connection";

export interface SetupFile {
  name: string;
  bytes: number;
  /** s since 1970, null where the system does not say. */
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
  calibrations: { scan: boolean; tip: boolean; payload: boolean };
  recordings: SetupFile[];
  check: CheckChoice;
  is_check_over: boolean;
  failure: { step: SetupStepName; why: string } | null;
}

const ADDRESS = "/api/setup";

/** The setup; "running" where there is a node, null where nobody answers or this page was not let in. */
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

/** Changes a part of the setup; how it is then. */
export async function changeSetup(what: SetupStepName, request: object): Promise<SetupState> {
  let answer: Response;
  try {
    answer = await fetch(`${ADDRESS}/${what}`, { method: "POST", body: JSON.stringify(request) });
  } catch {
    throw new CallError("lost");
  }
  return told(answer.ok, await answer.text());
}

/** Sends a scan; `onProgress` is told the share that has gone. Only this kind of request tells it. */
export function sendScan(file: File, onProgress: (share: number) => void): Promise<SetupState> {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open("POST", `${ADDRESS}/upload?name=${encodeURIComponent(file.name)}`);
    request.upload.onprogress = ({ loaded, total }) => total > 0 && onProgress(loaded / total);
    request.onerror = () => reject(new CallError("lost"));
    request.onload = () => {
      try {
        resolve(told(request.status === 200, request.responseText));
      } catch (error) {
        reject(error);
      }
    };
    request.send(file);
  });
}

function told(isGood: boolean, text: string): SetupState {
  let found: SetupState | { error: string };
  try {
    found = JSON.parse(text);
  } catch {
    throw new CallError("lost");
  }
  if (isGood) return found as SetupState;
  throw new CallError("refused", (found as { error: string }).error);
}
