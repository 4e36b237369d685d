/** The three-dimensional picture: the part, its features, the tip, the path; and the effect of a tap on it. */
import { Color, Group, Mesh, MeshBasicMaterial, SphereGeometry, Vector2, Vector3 } from "three";
import { CameraMan } from "./camera_man";
import { el } from "./dom";
import { drawFeatures, drawPath, drawTouch, Lines } from "./feature_lines";
import { Labels } from "./labels";
import { label } from "./language";
import type { MeshStore } from "./mesh_store";
import { MeshView } from "./mesh_view";
import type { NotedFeature, Xyz } from "./messages";
import { type Hit, pick } from "./pick";
import { Stage } from "./stage";
import { TipView } from "./tip_view";

/** A press that moves farther than this turns the part and is no tap, px. */
const STILL = 8;
/** A press that lasts longer is none either, ms. */
const BRIEF = 600;
/** Widths of lines, px. */
const WIDTHS = { features: 3, path: 4, touch: 7 };

export interface Taps {
  onSelect: (id: number) => void;
  /** @param x, y px from the upper left of the picture. */
  onTap: (hit: Hit | null, x: number, y: number) => void;
}

export class Picture {
  readonly canvas = el("canvas", { class: "canvas", attributes: { tabindex: "0", role: "application" } });
  readonly element = el("div", { class: "picture" }, this.canvas);
  readonly stage: Stage;
  readonly camera: CameraMan;
  readonly mesh: MeshView;
  readonly labels: Labels;
  readonly tip = new TipView();
  private readonly features = new Lines(WIDTHS.features);
  private readonly path = new Lines(WIDTHS.path);
  private readonly touch = new Lines(WIDTHS.touch);
  private readonly mark = new Mesh(new SphereGeometry(1, 20, 12), new MeshBasicMaterial({ color: "#a2058a", depthTest: false }));

  constructor(
    private readonly store: MeshStore,
    taps: Taps,
  ) {
    label(this.canvas, "pictureName");
    this.canvas.removeAttribute("title");
    this.stage = new Stage(this.canvas);
    this.camera = new CameraMan(this.stage, store);
    this.mesh = new MeshView(store);
    this.labels = new Labels(this.stage, taps.onSelect);
    this.element.append(this.labels.layer);
    this.mark.visible = false;
    // it lies in the surface, which is not to hide it
    this.touch.material.depthTest = false;
    this.touch.renderOrder = 1;
    const all = new Group();
    all.add(this.mesh.mesh, this.features, this.path, this.touch, this.tip, this.mark);
    this.stage.scene.add(all);
    this.stage.beforeFrame.push(() => this.mesh.update());
    this.listen(taps);
    this.theme();
  }

  /** Takes the colour behind the part from the style sheet. */
  theme(): void {
    const colour = getComputedStyle(document.documentElement).getPropertyValue("--picture").trim();
    this.stage.renderer.setClearColor(new Color(colour || "#eef1f4"));
    this.stage.ask();
  }

  showFeatures(features: NotedFeature[], selected: number | null): void {
    drawFeatures(this.features, features, selected);
    this.labels.show(features, selected);
  }

  showPath(stops: Xyz[]): void {
    drawPath(this.path, stops, 0.012 * this.size());
    this.stage.ask();
  }

  /** The removable touch, by contacts of it; none hides it. */
  showTouch(contacts: Xyz[]): void {
    drawTouch(this.touch, contacts);
    this.stage.ask();
  }

  /** A dot at a tapped place; null hides it. */
  showMark(place: [number, number, number] | null): void {
    this.mark.visible = place !== null;
    if (place !== null) {
      this.mark.position.set(...place);
      this.mark.scale.setScalar(0.006 * this.size());
    }
    this.stage.ask();
  }

  /** The part under a place of the picture, px from its upper left. */
  pickAt(x: number, y: number): Hit | null {
    const { camera, size } = this.stage;
    const at = new Vector2((2 * x) / size.width - 1, 1 - (2 * y) / size.height);
    camera.updateMatrixWorld();
    const through = new Vector3(at.x, at.y, 0.5).unproject(camera);
    const direction = through.sub(camera.position).normalize();
    return pick(this.store, camera.position.toArray(), direction.toArray());
  }

  /** Diagonal of the part, m. */
  private size(): number {
    const { low, high } = this.store;
    const diagonal = Math.hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
    return Number.isFinite(diagonal) ? diagonal : 0.1;
  }

  private listen({ onTap }: Taps): void {
    let down: { x: number; y: number; at: number } | null = null;
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => {
      down = event.isPrimary && event.button === 0 ? { x: event.clientX, y: event.clientY, at: event.timeStamp } : null;
    });
    canvas.addEventListener("pointerup", (event) => {
      const from = down;
      down = null;
      if (from === null || !event.isPrimary || event.timeStamp - from.at > BRIEF) return;
      if (Math.hypot(event.clientX - from.x, event.clientY - from.y) > STILL) return;
      const { left, top } = canvas.getBoundingClientRect();
      const [x, y] = [event.clientX - left, event.clientY - top];
      onTap(this.pickAt(x, y), x, y);
    });
    // by keyboard: the middle of the picture
    canvas.addEventListener("keydown", (event) => {
      if (event.key !== "Enter") return;
      const { width, height } = this.stage.size;
      onTap(this.pickAt(width / 2, height / 2), width / 2, height / 2);
    });
  }
}
