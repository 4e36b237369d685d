/** State of the page: the newest message of each topic, and the operator's choices. Displays listen to their changes. */
import type { Connection, LineState } from "./connection";
import type { Annotation, DiagnosticStatus, Feature, NotedFeature, ProbeResult, ProbeTouch, Relation, State } from "./messages";

/** Parts that change. */
export type Part = "state" | "line" | "features" | "diagnostics" | "selected" | "touches" | "result";

/** Largest number of remembered touches of one feature. */
const MOST_TOUCHES = 200;

export class Model {
  state: State | null = null;
  line: LineState = { kind: "connecting" };
  features: NotedFeature[] = [];
  /** Name of the frame that all places are in, which calls have to name too. */
  frame = "object";
  relations: Relation[] = [];
  /** The first status: whether the node uses its inputs. */
  input: DiagnosticStatus | null = null;
  /** By the number of the feature. */
  readonly touches = new Map<number, ProbeTouch[]>();
  result: ProbeResult | null = null;
  selected: number | null = null;
  private measured: Feature[] = [];
  private annotations: Record<string, Annotation> = {};
  private readonly listeners: Array<[Part[], () => void]> = [];

  /** @param replayed name of the replayed session; null: the page shows the running one. */
  constructor(
    connection: Connection,
    readonly replayed: string | null = null,
  ) {
    connection.onState((line) => this.set("line", () => (this.line = line)));
    connection.on("state", (state) => this.set("state", () => this.takeState(state)));
    connection.on("features", (message) =>
      this.set("features", () => {
        this.measured = message.features;
        this.relations = message.relations ?? [];
        this.frame = message.header?.frame_id || this.frame;
        this.note();
      }),
    );
    connection.on("annotations", (message) =>
      this.set("features", () => {
        this.annotations = message.features;
        this.note();
      }),
    );
    connection.on("diagnostics", (message) => this.set("diagnostics", () => (this.input = message.status[0] ?? null)));
    connection.on("probe_results", (result) => this.set("result", () => (this.result = result)));
    connection.on("probe_touches", (touch) => this.set("touches", () => this.takeTouch(touch)));
  }

  on(parts: Part[], listener: () => void): void {
    this.listeners.push([parts, listener]);
  }

  feature(id: number | null): NotedFeature | undefined {
    return this.features.find((feature) => feature.id === id);
  }

  select(id: number | null): void {
    if (id !== this.selected) this.set("selected", () => (this.selected = id));
  }

  get isConnected(): boolean {
    return this.line.kind === "connected";
  }

  /** Whether this page may make calls now. */
  get mayOperate(): boolean {
    return this.isConnected && this.state?.role === "operate";
  }

  /** Combines measurements with notes; the numbers of a locked feature stay as they were. */
  private note(): void {
    this.features = this.measured.map((feature) => {
      const { name = "", mark = "none", locked = null } = this.annotations[feature.id] ?? {};
      return { ...feature, ...locked, name, mark, is_locked: locked !== null };
    });
  }

  private takeState(state: State): void {
    if (this.state !== null && this.state.session !== state.session) {
      this.touches.clear();
      this.result = null;
      this.selected = null;
    }
    this.state = state;
  }

  private takeTouch(touch: ProbeTouch): void {
    const known = touch.index === 0 ? [] : (this.touches.get(touch.id) ?? []);
    this.touches.set(touch.id, [...known, touch].slice(-MOST_TOUCHES));
  }

  private set(part: Part, change: () => void): void {
    change();
    for (const [parts, listener] of this.listeners) if (parts.includes(part)) listener();
  }
}
