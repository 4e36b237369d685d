/**
 * JSON messages, as far as the page reads them. Names and units are those of `msg/` and docs/ros.md: m, rad, N, s. An unknown number is
 * null (NaN has no place in JSON).
 */

export type Num = number | null;

export interface Xyz {
  x: Num;
  y: Num;
  z: Num;
}

/** Topic `state`: the page's own. */
export interface State {
  role: "look" | "operate";
  program: string;
  session: string;
  is_paused: boolean;
  /** `is_size_confirmed`: an operator has just said on the page how large it is. */
  scan: { file: string; faces: number; is_size_confirmed: boolean };
  /** Its file, if the node has one. */
  nominal_part: string | null;
  arm: null | { may_move: boolean; motion: "rests" | "moves" | "retracts"; stays_because?: string | null };
  clients: number;
}

export const Kind = {
  unknown: 0, hole: 1, slot: 2, pocket: 3, boss: 4, edge: 5, corner: 6, plane: 7, cylinder: 8, notch: 9, sphere: 10,
} as const;
export const Status = { flagged: 1, found: 2, probed: 3 } as const;
export const FittedTo = { nothing: 0, mesh: 1, touches: 2 } as const;

export type Mark = "none" | "accepted" | "rejected";

export interface FormDeviation {
  characteristic: number;
  zone: Num;
  zone_std: Num;
  least_squares: Num;
  coverage: Num;
  undulations: number;
  lobes: number[];
}

/** Numbers with their standard uncertainties. */
type Stated<Name extends string> = Record<Name | `${Name}_std`, Num>;

export interface Feature extends Stated<"diameter" | "length" | "width" | "depth" | "cone_angle"> {
  id: number;
  kind: number;
  status: number;
  fitted_to: number;
  touched: Num;
  touch_count: number;
  search_radius: Num;
  center: Xyz;
  center_std: Num;
  axis: Xyz;
  axis_std: Num;
  direction: Xyz;
  depth_is_at_least: boolean;
  through: number;
  convex: number;
  group: number;
  points: Xyz[];
  form: FormDeviation[];
}

/** Operators' notes on a feature; `locked`: its state at the lock, which counts from then on. */
export interface Annotation {
  name: string;
  mark: Mark;
  locked: Feature | null;
}

/** A feature as the page shows it: with its notes. */
export interface NotedFeature extends Feature {
  name: string;
  mark: Mark;
  is_locked: boolean;
}

export interface Relation extends Stated<"zone" | "angle" | "distance" | "concentricity"> {
  kind: number;
  of_feature: number;
  to_feature: number;
}

export interface FeatureArray {
  header: { frame_id: string };
  session: string;
  mesh_version: number;
  features: Feature[];
  relations: Relation[];
  unexplained: Num;
}

export interface Marker {
  ns: string;
  id: number;
  type: number;
  action: number;
  pose: { position: Xyz };
  scale: Xyz;
  points: Xyz[];
  text: string;
}

export interface Mismatch {
  tip: Xyz;
  actual_force: Xyz;
  signed_distance: Num;
}

export interface DiagnosticStatus {
  /** 0 good, 1 warning, 2 error, 3 nothing comes. */
  level: number;
  name: string;
  message: string;
  values: Array<{ key: string; value: string }>;
}

export interface ProbeResult {
  id: number;
  code: number;
  message: string;
  touch_count: number;
  max_force: Num;
  duration: Num;
}

/** Codes of `ProbeResult` from which on the arm stands until an acknowledgement. */
export const STOPPED_FROM = 40;
export const PLANNED = 4;

export interface ProbeTouch {
  id: number;
  index: number;
  verdict: number;
  accepted: boolean;
  reason: string;
  curve_time: Num[];
  curve_travel: Num[];
  curve_force: Num[];
  curve_lateral_force: Num[];
}

export interface Session {
  name: string;
  is_current: boolean;
  bytes: number;
  files: string[];
  /** RFC 3339; absent without a record of it. */
  begun?: string;
}

/** Topic `replay`: how far the replay of a session is. Times are those along the recording without its long pauses, s. */
export interface ReplayState {
  session: string;
  /** False during the reading of the session. */
  is_ready: boolean;
  speed: number;
  is_paused: boolean;
  at_s: number;
  end_s: number;
  /** Target of its fast forward; null: it plays. */
  target_s: number | null;
  is_at_end: boolean;
  damage: string | null;
  /** Why there is none, or it does not go on. */
  error: string | null;
}

/** Message of each topic. */
export interface Topics {
  state: State;
  features: FeatureArray;
  annotations: { session: string; features: Record<string, Annotation> };
  tip: { markers: Marker[] };
  mismatch: Mismatch;
  diagnostics: { status: DiagnosticStatus[] };
  path: { poses: Array<{ pose: { position: Xyz } }> };
  probe_results: ProbeResult;
  probe_touches: ProbeTouch;
  replay: ReplayState;
}

export type TopicName = keyof Topics;

/** Answer of most services. */
export interface Answer {
  success: boolean;
  message: string;
}

/** As three numbers, or null with an unknown one. */
export function triple(at: Xyz | undefined): [number, number, number] | null {
  if (at === undefined || at.x === null || at.y === null || at.z === null) return null;
  return [at.x, at.y, at.z];
}
