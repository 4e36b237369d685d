/**
 * The stage of everything three-dimensional: renderer, camera, light, and the one place that decides when to draw.
 *
 * It draws on request, once per frame of the screen, and rests else: a tablet stays cool beside the cell.
 */
import { DirectionalLight, HemisphereLight, PerspectiveCamera, Scene, WebGLRenderer } from "three";

/** Number of remembered main-thread times of frames, for tests. */
const REMEMBERED = 600;
/** More pixels than this for each point of the screen are invisible. */
const MOST_PIXEL_RATIO = 2;

export class Stage {
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(35, 1, 1e-3, 10);
  readonly renderer: WebGLRenderer;
  /** Milliseconds of the main thread for each of the last frames. */
  readonly frameTimes: number[] = [];
  /** Called before each frame, in order. */
  readonly beforeFrame: Array<() => void> = [];
  /** Calls after each frame, to move HTML. */
  readonly afterFrame: Array<() => void> = [];
  /** Least time between frames, ms: while somebody holds the arm's button its beats go first. */
  leastInterval = 0;
  private lastFrame = 0;
  private isAsked = false;
  private resting: Array<() => void> = [];

  constructor(readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: "high-performance" });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, MOST_PIXEL_RATIO));
    this.camera.up.set(0, 0, 1);
    const lamp = new DirectionalLight(0xffffff, 1.6);
    lamp.position.set(-0.3, 0.6, 1);
    this.camera.add(lamp);
    this.scene.add(this.camera, new HemisphereLight(0xffffff, 0x667788, 1.4));
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement ?? canvas);
    canvas.addEventListener("webglcontextrestored", () => this.ask());
    this.resize();
  }

  /** Have a frame drawn soon. */
  ask(): void {
    if (this.isAsked) return;
    this.isAsked = true;
    const draw = (): number => requestAnimationFrame(() => this.frame());
    const wait = this.lastFrame + this.leastInterval - performance.now();
    if (wait > 0) setTimeout(draw, wait);
    else draw();
  }

  /** Resolves after all requested drawing. */
  idle(): Promise<void> {
    if (!this.isAsked) return Promise.resolve();
    return new Promise((resolve) => this.resting.push(resolve));
  }

  get size(): { width: number; height: number } {
    const { clientWidth, clientHeight } = this.canvas;
    return { width: Math.max(clientWidth, 1), height: Math.max(clientHeight, 1) };
  }

  /** Red, green, blue, alpha of one place of the picture, drawn anew for it: the browser does not keep the picture. */
  pixel(x: number, y: number): number[] {
    for (const each of this.beforeFrame) each();
    this.renderer.render(this.scene, this.camera);
    const gl = this.renderer.getContext();
    const ratio = this.renderer.getPixelRatio();
    const bytes = new Uint8Array(4);
    gl.readPixels(Math.floor(x * ratio), Math.ceil((this.size.height - y) * ratio) - 1, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    return [...bytes];
  }

  private frame(): void {
    const begin = performance.now();
    this.lastFrame = begin;
    this.isAsked = false;
    for (const each of this.beforeFrame) each();
    this.renderer.render(this.scene, this.camera);
    for (const each of this.afterFrame) each();
    this.frameTimes.push(performance.now() - begin);
    if (this.frameTimes.length > REMEMBERED) this.frameTimes.shift();
    if (this.isAsked) return;
    const resting = this.resting;
    this.resting = [];
    for (const resolve of resting) resolve();
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.canvas.parentElement ?? this.canvas;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.ask();
  }
}
