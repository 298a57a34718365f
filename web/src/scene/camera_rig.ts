import type { Box, Vec3 } from "../protocol/frames.ts";

export const CAMERA_MODES = ["orbit", "walk", "follow", "plan"] as const;
export type CameraMode = (typeof CAMERA_MODES)[number];

export interface Basis { right: Vec3; up: Vec3; ahead: Vec3 }

const FIT_SHARE = 0.94;  // of the view that a fitted model takes
const LEAST_DISTANCE_M = 0.1, MOST_DISTANCE_M = 2000;
/** Half the height of the view at distance 1. */
export const VIEW_SLOPE = Math.tan((50 / 2) * Math.PI / 180);

const clamp = (value: number, low: number, high: number): number => Math.min(Math.max(value, low), high);
const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const along = (a: Vec3, b: Vec3, scale: number): Vec3 => [a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2]];

/**
 * Where the model is looked at from: a target, a distance, two angles. z is up; azimuth 0 looks along +y, elevation is that
 * of the camera above the target, radians. In `walk` the camera turns about itself, in `plan` it looks straight down.
 */
export class CameraRig {
  mode: CameraMode = "orbit";
  target: Vec3 = [0, 0, 1];
  distance = 12;
  azimuth = 0.6;
  elevation = 0.75;

  basis(): Basis {
    const elevation = this.mode === "plan" ? Math.PI / 2 : this.elevation;
    const [sa, ca, se, ce] = [Math.sin(this.azimuth), Math.cos(this.azimuth), Math.sin(elevation), Math.cos(elevation)];
    return { right: [ca, -sa, 0], up: [sa * se, ca * se, ce], ahead: [sa * ce, ca * ce, -se] };
  }

  eye(): Vec3 { return along(this.target, this.basis().ahead, -this.distance); }

  setMode(mode: CameraMode): void {
    if (mode === this.mode) return;
    const eye = this.eye();
    if (this.mode === "plan") [this.azimuth, this.elevation] = [this.azimuth, 0.75];
    this.mode = mode;
    if (mode === "plan") this.azimuth = 0;
    if (mode === "walk") {
      // From inside: the head stays level.
      this.elevation = clamp(this.elevation, -0.2, 0.2);
      this.target = along(eye, this.basis().ahead, this.distance);
    }
  }

  /** Turns by pixels of a drag. */
  turn(dx: number, dy: number): void {
    const eye = this.eye(), inside = this.mode === "walk", sense = inside ? -0.6 : 1;
    this.azimuth += sense * 0.006 * dx;
    if (this.mode !== "plan") this.elevation = clamp(this.elevation + sense * 0.006 * dy, -1.55, 1.55);
    if (inside) this.target = along(eye, this.basis().ahead, this.distance);
  }

  /** Shifts by pixels of a view of this height; what is at the target stays under the pointer. */
  pan(dx: number, dy: number, viewHeight: number): void {
    const { right, up } = this.basis(), scale = 2 * this.distance * VIEW_SLOPE / viewHeight;
    this.target = along(along(this.target, right, -scale * dx), up, scale * dy);
  }

  /** Nearer (below 1) or further, towards `at` where it is given, so that this point stays where it is in the view. */
  zoom(factor: number, at?: Vec3): void {
    if (this.mode === "walk") {
      this.walk(0, this.distance * 0.1 * Math.sign(1 - factor), 0);
      return;
    }
    const distance = clamp(this.distance * factor, LEAST_DISTANCE_M, MOST_DISTANCE_M), share = 1 - distance / this.distance;
    if (at && this.mode !== "follow") this.target = [0, 1, 2].map(k => this.target[k] + share * (at[k] - this.target[k])) as Vec3;
    this.distance = distance;
  }

  /** Moves level, metres to the right, ahead and up. */
  walk(right: number, ahead: number, up: number): void {
    const [sa, ca] = [Math.sin(this.azimuth), Math.cos(this.azimuth)];
    this.target = [this.target[0] + ca * right + sa * ahead, this.target[1] - sa * right + ca * ahead, this.target[2] + up];
  }

  /** Moves the camera to a place inside, looking ahead as before. */
  standAt(eye: Vec3): void {
    this.target = along(eye, this.basis().ahead, this.distance);
  }

  /**
   * Looks at the whole box from as near as it can be seen: across and above, the two lines that bound its corners meet at the
   * camera.
   */
  fit(box: Box, aspect: number): void {
    const { right, up, ahead } = this.basis();
    const corners = Array.from({ length: 8 }, (_, i) => [0, 1, 2].map(k => (i >> k & 1 ? box.high[k] : box.low[k])) as Vec3);
    let depth = Infinity;
    const [across, above] = ([[right, VIEW_SLOPE * aspect], [up, VIEW_SLOPE]] as const).map(([axis, slope]) => {
      const steep = this.mode === "plan" ? 0 : FIT_SHARE * slope;
      const high = Math.max(...corners.map(p => dot(p, axis) - steep * dot(p, ahead))), low = Math.max(...corners.map(p => -dot(p, axis) - steep * dot(p, ahead)));
      depth = Math.min(depth, steep > 0 ? -(high + low) / (2 * steep) : dot(box.low, ahead) - (high + low) / (2 * FIT_SHARE * slope));
      return (high - low) / 2;
    });
    const depths = corners.map(p => dot(p, ahead)), middle = (Math.min(...depths) + Math.max(...depths)) / 2;
    this.distance = clamp(this.mode === "plan" ? dot(box.low, ahead) - depth : middle - depth, LEAST_DISTANCE_M, MOST_DISTANCE_M);
    this.target = [0, 1, 2].map(k => across * right[k] + above * up[k] + (depth + this.distance) * ahead[k]) as Vec3;
  }
}
