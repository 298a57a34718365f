import { element } from "../panels/dom.ts";

/** A stick for a thumb; back in the middle when it is let go. x to the right, y up, -1 to 1. */
export class Stick {
  readonly box: HTMLElement;
  x = 0;
  y = 0;
  private readonly knob = element("i");
  private pointer: number | null = null;

  constructor(label: string) {
    this.box = element("div", { class: "stick", role: "img", "aria-label": label }, this.knob, element("span", {}, label));
    this.box.addEventListener("pointerdown", event => {
      this.pointer = event.pointerId;
      this.box.setPointerCapture(event.pointerId);
      this.move(event);
    });
    this.box.addEventListener("pointermove", event => { if (event.pointerId === this.pointer) this.move(event); });
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"] as const) this.box.addEventListener(kind, () => this.release());
  }

  release(): void {
    this.pointer = null;
    this.place(0, 0);
  }

  private move(event: PointerEvent): void {
    event.preventDefault();
    const box = this.box.getBoundingClientRect(), radius = box.width / 2;
    const x = (event.clientX - box.left - radius) / radius, y = -(event.clientY - box.top - radius) / radius, size = Math.max(1, Math.hypot(x, y));
    this.place(x / size, y / size);
  }

  private place(x: number, y: number): void {
    [this.x, this.y] = [x, y];
    const radius = this.box.clientWidth / 2;
    this.knob.style.transform = `translate(${x * radius * 0.7}px, ${-y * radius * 0.7}px)`;
  }
}
