import type { SceneView } from "./scene_view.ts";
import type { Vec3 } from "../protocol/frames.ts";

const CLICK_PX = 6, WALK_M_S = 1.6, TURN_PX_S = 260;
const MOVE_KEYS: Record<string, Vec3> = {
  KeyW: [0, 1, 0], KeyS: [0, -1, 0], KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyE: [0, 0, 1], KeyQ: [0, 0, -1],
};
const TURN_KEYS: Record<string, [number, number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

export interface ControlsListener {
  /** A click or tap that was no drag, in pixels of the page. */
  onClick(x: number, y: number): void;
  onDoubleClick(x: number, y: number): void;
  /** The surface under the pointer, to zoom towards it. */
  surfaceAt(x: number, y: number): Vec3 | null;
  /** The view moved. */
  onMoved(): void;
}

/** Pointer, wheel and keys of the canvas. One finger or the left button turns, two fingers or the right button pan and zoom. */
export class Controls {
  private readonly pointers = new Map<number, { x: number; y: number }>();
  private readonly keys = new Set<string>();
  private dragged = 0;
  private panning = false;
  /** The pilot flies with the keys: the camera leaves them alone. */
  keysTaken = false;

  constructor(private readonly view: SceneView, private readonly listener: ControlsListener) {
    const canvas = view.canvas;
    canvas.addEventListener("pointerdown", event => this.down(event));
    canvas.addEventListener("pointermove", event => this.move(event));
    for (const kind of ["pointerup", "pointercancel"] as const) canvas.addEventListener(kind, event => this.up(event));
    canvas.addEventListener("wheel", event => this.wheel(event), { passive: false });
    canvas.addEventListener("contextmenu", event => event.preventDefault());
    canvas.addEventListener("dblclick", event => this.listener.onDoubleClick(event.clientX, event.clientY));
    canvas.addEventListener("keydown", event => this.key(event));
    canvas.addEventListener("keyup", event => this.keys.delete(event.code));
    canvas.addEventListener("blur", () => this.keys.clear());
  }

  /** Moves by the keys that are held; true while something moves. */
  step(dtS: number): boolean {
    if (this.keys.size === 0) return false;
    const { rig } = this.view, speed = rig.mode === "walk" ? WALK_M_S : Math.max(rig.distance * 0.5, 0.5);
    for (const code of this.keys) {
      const way = MOVE_KEYS[code], turn = TURN_KEYS[code];
      if (way) rig.walk(way[0] * speed * dtS, way[1] * speed * dtS, way[2] * speed * dtS);
      if (turn) rig.turn((rig.mode === "walk" ? -1 : 1) * turn[0] * TURN_PX_S * dtS, (rig.mode === "walk" ? -1 : 1) * turn[1] * TURN_PX_S * dtS);
    }
    this.listener.onMoved();
    return true;
  }

  private down(event: PointerEvent): void {
    this.view.canvas.focus({ preventScroll: true });
    try {
      this.view.canvas.setPointerCapture(event.pointerId);
    } catch { /* a pointer that has ended meanwhile */ }
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (this.pointers.size === 1) this.dragged = 0;
    else this.dragged = CLICK_PX + 1;
    this.panning = event.button === 2 || event.button === 1 || event.shiftKey;
  }

  private move(event: PointerEvent): void {
    const old = this.pointers.get(event.pointerId);
    if (!old) return;
    const dx = event.clientX - old.x, dy = event.clientY - old.y, other = [...this.pointers].find(([id]) => id !== event.pointerId)?.[1];
    this.dragged += Math.hypot(dx, dy);
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (this.dragged <= CLICK_PX) return;
    const { rig, canvas } = this.view;
    if (other) {
      const before = Math.hypot(old.x - other.x, old.y - other.y), after = Math.hypot(event.clientX - other.x, event.clientY - other.y);
      if (before > 0 && after > 0) rig.zoom(before / after);
      rig.pan(dx / 2, dy / 2, canvas.clientHeight);
    } else if (this.panning || rig.mode === "plan") rig.pan(dx, dy, canvas.clientHeight);
    else rig.turn(dx, dy);
    this.moved();
  }

  private up(event: PointerEvent): void {
    const known = this.pointers.delete(event.pointerId);
    if (known && event.type === "pointerup" && this.pointers.size === 0 && this.dragged <= CLICK_PX && event.button === 0)
      this.listener.onClick(event.clientX, event.clientY);
  }

  private wheel(event: WheelEvent): void {
    event.preventDefault();
    const step = event.deltaMode === 1 ? 30 * event.deltaY : event.deltaY;
    this.view.rig.zoom(Math.exp(0.0012 * step), this.listener.surfaceAt(event.clientX, event.clientY) ?? undefined);
    this.moved();
  }

  private key(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey || this.keysTaken) return;
    if (event.code in MOVE_KEYS || event.code in TURN_KEYS) {
      this.keys.add(event.code);
      event.preventDefault();
    } else if (event.key === "+" || event.key === "=") this.view.rig.zoom(0.85);
    else if (event.key === "-") this.view.rig.zoom(1 / 0.85);
    else return;
    this.moved();
  }

  private moved(): void {
    this.view.requestDraw();
    this.listener.onMoved();
  }
}
