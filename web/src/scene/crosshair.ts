import { byId } from "../panels/dom.ts";

/**
 * The middle of the view as what the keyboard points at: shown while something is to be chosen in the model and keys, not a
 * pointer, were used last. The arrows turn the model below it, Enter chooses.
 */
export class Crosshair {
  private readonly mark = byId("crosshair");
  private wanted = false;
  private keysUsed = false;

  constructor(private readonly canvas: HTMLElement) {
    window.addEventListener("keydown", event => { if (!event.ctrlKey && !event.metaKey && !event.altKey) this.usedKeys(true); }, { capture: true });
    window.addEventListener("pointerdown", () => this.usedKeys(false), { capture: true });
  }

  get shown(): boolean { return !this.mark.hidden; }

  /** A tool was chosen, with which something is to be chosen in the model, or left. */
  want(wanted: boolean): void {
    this.wanted = wanted;
    this.update();
    if (this.shown) this.canvas.focus({ preventScroll: true });  // arrows are its keys
  }

  /** The place that it marks, in pixels of the page. */
  place(): [number, number] {
    const box = this.canvas.getBoundingClientRect();
    return [box.x + box.width / 2, box.y + box.height / 2];
  }

  private usedKeys(used: boolean): void {
    this.keysUsed = used;
    this.update();
  }

  private update(): void { this.mark.hidden = !(this.wanted && this.keysUsed); }
}
