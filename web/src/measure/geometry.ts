import type { Vec3 } from "../protocol/frames.ts";
import type { SurfacePoint } from "./raycast.ts";

/** A point on the surface as it was chosen: what it is known by. */
export interface MeasuredPoint extends SurfacePoint {
  /** How well it could be aimed at: what a pixel covered there, m. */
  pixelM: number;
}

/** A value and its standard deviation, m or square metres. */
export interface Measured { value: number; sigma: number }

const minus = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a: Vec3, b: Vec3): Vec3 => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/**
 * Variance of the point along a unit direction: the surface's own error along its normal (half a voxel where it is unknown,
 * a whole one more on a coarse level), and the aim along the surface.
 */
export function varianceAlong(point: MeasuredPoint, direction: Vec3, voxelM: number): number {
  const surface = (point.errorM ?? voxelM / 2) ** 2 + (point.level > 0 ? voxelM ** 2 : 0) + point.quantumM ** 2 / 12;
  const share = dot(point.normal, direction) ** 2;
  return share * surface + (1 - share) * (point.pixelM ** 2 + point.quantumM ** 2 / 12);
}

/** Straight distance of two points. */
export function distance(a: MeasuredPoint, b: MeasuredPoint, voxelM: number): Measured {
  const way = minus(b.point, a.point), value = Math.hypot(...way);
  const direction = (value > 0 ? way.map(v => v / value) : [0, 0, 1]) as Vec3;
  return { value, sigma: Math.sqrt(varianceAlong(a, direction, voxelM) + varianceAlong(b, direction, voxelM)) };
}

/** How much higher one point is than the other. */
export function heightDifference(a: MeasuredPoint, b: MeasuredPoint, voxelM: number): Measured {
  const up: Vec3 = [0, 0, 1];
  return { value: Math.abs(b.point[2] - a.point[2]), sigma: Math.sqrt(varianceAlong(a, up, voxelM) + varianceAlong(b, up, voxelM)) };
}

/** Area of a polygon, which need not be quite flat: that of its projection along its mean normal (Newell's). */
export function polygonArea(points: MeasuredPoint[], voxelM: number): Measured {
  const corner = (i: number): Vec3 => points[(i + points.length) % points.length].point;
  const sum: Vec3 = [0, 0, 0];
  points.forEach((_, i) => cross(minus(corner(i), corner(0)), minus(corner(i + 1), corner(0))).forEach((value, k) => { sum[k] += value / 2; }));
  const value = Math.hypot(...sum), normal = sum.map(v => v / (value || 1)) as Vec3;
  // The area changes with a corner by half the line between its neighbours, across that line.
  let variance = 0;
  points.forEach((point, i) => {
    const gradient = cross(normal, minus(corner(i + 1), corner(i - 1))).map(v => v / 2) as Vec3, size = Math.hypot(...gradient);
    if (size > 0) variance += size ** 2 * varianceAlong(point, gradient.map(v => v / size) as Vec3, voxelM);
  });
  return { value, sigma: Math.sqrt(variance) };
}
