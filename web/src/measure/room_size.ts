import type { Vec3 } from "../protocol/frames.ts";
import type { Measured } from "./geometry.ts";
import type { Ray, SurfacePoint } from "./raycast.ts";

/** Inner size of a room along the directions of its walls, and upwards. */
export interface RoomSize {
  axes: [Vec3, Vec3, Vec3];
  sizes: (Measured | null)[];           // null: no surface on one of the sides
  ends: ([Vec3, Vec3] | null)[];        // where each size was measured
}

type Cast = (ray: Ray) => SurfacePoint | null;
const DIRECTIONS = 72, RAYS_A_SIDE = 7, SPREAD_M = 0.25, LEAST_RAYS = 10;

/** Measures the room around a point inside of it: of each side, the median of a bundle of parallel rays. */
export function measureRoom(cast: Cast, center: Vec3, voxelM: number): RoomSize {
  const yaw = wallDirection(cast, center), [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  const axes: [Vec3, Vec3, Vec3] = [[c, s, 0], [-s, c, 0], [0, 0, 1]];
  const sizes: (Measured | null)[] = [], ends: ([Vec3, Vec3] | null)[] = [];
  axes.forEach((axis, k) => {
    const across = [axes[(k + 1) % 3], axes[(k + 2) % 3]] as const;
    const behind = side(cast, center, axis.map(v => -v) as Vec3, across, voxelM), ahead = side(cast, center, axis, across, voxelM);
    const at = (distanceM: number): Vec3 => [0, 1, 2].map(i => center[i] + distanceM * axis[i]) as Vec3;
    sizes.push(behind && ahead && { value: behind.value + ahead.value, sigma: Math.hypot(behind.sigma, ahead.sigma) });
    ends.push(behind && ahead && [at(-behind.value), at(ahead.value)]);
  });
  return { axes, sizes, ends };
}

/** The direction of the walls, -45 to 45 degrees: the mean of four times the angle of what upright surfaces face. */
export function wallDirection(cast: Cast, center: Vec3): number {
  let x = 0, y = 0;
  for (let i = 0; i < DIRECTIONS; ++i) {
    const turn = 2 * Math.PI * i / DIRECTIONS, hit = cast({ origin: center, direction: [Math.cos(turn), Math.sin(turn), 0] });
    if (!hit || Math.abs(hit.normal[2]) > 0.3) continue;
    const angle = 4 * Math.atan2(hit.normal[1], hit.normal[0]);
    x += Math.cos(angle);
    y += Math.sin(angle);
  }
  return x === 0 && y === 0 ? 0 : Math.atan2(y, x) / 4;
}

/** Distance of the side in this direction: rays through doors and onto furniture differ from the median and do not count. */
function side(cast: Cast, center: Vec3, direction: Vec3, across: readonly [Vec3, Vec3], voxelM: number): Measured | null {
  const hits: SurfacePoint[] = [];
  for (let i = 0; i < RAYS_A_SIDE ** 2; ++i) {
    const u = SPREAD_M * (2 * (i % RAYS_A_SIDE) / (RAYS_A_SIDE - 1) - 1), v = SPREAD_M * (2 * Math.floor(i / RAYS_A_SIDE) / (RAYS_A_SIDE - 1) - 1);
    const hit = cast({ origin: [0, 1, 2].map(k => center[k] + u * across[0][k] + v * across[1][k]) as Vec3, direction });
    if (hit) hits.push(hit);
  }
  if (hits.length < LEAST_RAYS) return null;
  const middle = median(hits.map(hit => hit.distanceM)), near = hits.filter(hit => Math.abs(hit.distanceM - middle) < 2 * voxelM);
  if (near.length < LEAST_RAYS) return null;
  const value = near.reduce((sum, hit) => sum + hit.distanceM, 0) / near.length;
  // Errors of neighbouring surface are alike: they do not average out.
  const error = median(near.map(hit => (hit.errorM ?? voxelM / 2) + (hit.level > 0 ? voxelM : 0)));
  const spread = Math.sqrt(near.reduce((sum, hit) => sum + (hit.distanceM - value) ** 2, 0) / near.length);
  return { value, sigma: Math.hypot(error, spread) };
}

function median(values: number[]): number {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.floor(sorted.length / 2)];
}
