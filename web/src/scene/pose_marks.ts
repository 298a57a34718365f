import { Group, Matrix4, Quaternion, Vector3 } from "three";
import type { Pose } from "../protocol/frames.ts";
import { Lines } from "./lines.ts";

const FRUSTUM_M = 0.6, ARM_M = 0.25, ROTOR_M = 0.13;

/** Camera's pyramid of view, six numbers a segment, in the camera's frame (looking along +z). */
export function frustumSegments([horizontal, vertical]: [number, number], depthM: number): number[] {
  const x = depthM * Math.tan(horizontal || 0.5), y = depthM * Math.tan(vertical || 0.4);
  const corners = [[-x, -y], [x, -y], [x, y], [-x, y]].map(([a, b]) => [a, b, depthM]);
  const segments = corners.flatMap((corner, i) => [0, 0, 0, ...corner, ...corner, ...corners[(i + 1) % 4]]);
  // A small roof shows what is up (y is down).
  return [...segments, -x * 0.4, -y, depthM, 0, -y * 1.35, depthM, 0, -y * 1.35, depthM, x * 0.4, -y, depthM];
}

/** A quadrotor with a nose, in the vehicle's frame (x ahead, z up). */
export function vehicleSegments(): number[] {
  const segments: number[] = [], arm = ARM_M / Math.SQRT2;
  for (const [sx, sy] of [[1, 1], [1, -1], [-1, -1], [-1, 1]]) {
    const x = sx * arm, y = sy * arm;
    segments.push(0, 0, 0, x, y, 0.03);
    for (let i = 0; i < 12; ++i) {
      const at = (turn: number): number[] => [x + ROTOR_M * Math.cos(turn), y + ROTOR_M * Math.sin(turn), 0.05];
      segments.push(...at(i * Math.PI / 6), ...at((i + 1) * Math.PI / 6));
    }
  }
  return [...segments, 0, 0, 0, 0.4, 0, 0, 0.4, 0, 0, 0.3, 0.06, 0, 0.4, 0, 0, 0.3, -0.06, 0];
}

/** Where the camera and the vehicle are. */
export class PoseMarks {
  readonly group = new Group();
  private readonly camera = new Lines({ color: "#ffffff", widthPx: 2 });
  private readonly vehicle = new Lines({ color: "#ffffff", widthPx: 2.5 });
  readonly colors: Record<Pose["state"], string> = { tracked: "#4aa3ff", estimated: "#e8b04a", lost: "#ff5d68" };

  constructor() {
    this.vehicle.setSegments(Float32Array.from(vehicleSegments()));
    this.hide();
    this.group.add(this.camera, this.vehicle);
  }

  hide(): void { this.camera.visible = this.vehicle.visible = false; }

  set(pose: Pose): void {
    const mark = pose.which === "camera" ? this.camera : this.vehicle;
    if (pose.which === "camera") mark.setSegments(Float32Array.from(frustumSegments(pose.halfFieldRad, FRUSTUM_M)));
    mark.material.uniforms.color.value.setStyle(this.colors[pose.state]).convertLinearToSRGB();
    mark.matrixAutoUpdate = false;
    mark.matrix.copy(new Matrix4().compose(new Vector3(...pose.position), new Quaternion(...pose.quaternion), new Vector3(1, 1, 1)));
    mark.matrixWorldNeedsUpdate = true;
    mark.visible = true;
  }
}
