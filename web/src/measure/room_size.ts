import type { Vec3 } from "../protocol/frames.ts";
import type { Measured } from "./geometry.ts";
import type { Ray, SurfacePoint } from "./raycast.ts";

/** Inner size of a room along the directions of its walls, and upwards. */
export interface RoomSize {
  axes: [Vec3, Vec3, Vec3];
  sizes: (Measured | null)[];           // null: no surface on one of the sides
  ends: ([Vec3, Vec3] | null)[];        // where each size was measured
}

/** A ray's end on a wall: how far it is along the axis, and to the side of it; in which column of the fan. */
interface Hit { offset: number; lateral: number; column: number; surface: SurfacePoint }
type Cast = (ray: Ray) => SurfacePoint | null;
const DIRECTIONS = 72, LEAST_RAYS = 10;
/** Rays of one side: tangents across it, and how many steps to either side. */
const FAN = [{ slope: 1.2, steps: 8 }, { slope: 0.9, steps: 6 }];
/** A far wall fills little of the fan: a narrower one then follows. */
const NARROWER = [1, 0.5, 0.25];
const LEAST_FACING = 0.9, REFINEMENTS = 2;

/** Measures the room around a point inside of it: of each side the plane that a fan of rays meets in most columns. */
export function measureRoom(cast: Cast, center: Vec3, voxelM: number): RoomSize {
  let yaw = wallDirection(cast, center);
  for (let round = 0; round < REFINEMENTS; ++round) yaw += remainingTurn(cast, center, levelAxes(yaw), voxelM);
  const [x, y] = levelAxes(yaw), axes: [Vec3, Vec3, Vec3] = [x, y, [0, 0, 1]];
  const sizes: (Measured | null)[] = [], ends: ([Vec3, Vec3] | null)[] = [];
  axes.forEach((axis, k) => {
    const across: [Vec3, Vec3] = [axes[(k + 1) % 3], axes[(k + 2) % 3]];
    const behind = side(planeOf(cast, center, minus(axis), across, voxelM), voxelM), ahead = side(planeOf(cast, center, axis, across, voxelM), voxelM);
    const at = (distanceM: number): Vec3 => [0, 1, 2].map(i => center[i] + distanceM * axis[i]) as Vec3;
    sizes.push(behind && ahead && { value: behind.value + ahead.value, sigma: Math.hypot(behind.sigma, ahead.sigma) });
    ends.push(behind && ahead && [at(-behind.value), at(ahead.value)]);
  });
  return { axes, sizes, ends };
}

const levelAxes = (yaw: number): [Vec3, Vec3] => [[Math.cos(yaw), Math.sin(yaw), 0], [-Math.sin(yaw), Math.cos(yaw), 0]];

/** By how much the walls are turned against these axes: the slope of all four, by least squares. Normals alone are rounded off at corners. */
function remainingTurn(cast: Cast, center: Vec3, [x, y]: [Vec3, Vec3], voxelM: number): number {
  let products = 0, squares = 0;
  for (const [axis, along] of [[x, y], [y, minus(x)], [minus(x), minus(y)], [minus(y), x]]) {
    const plane = planeOf(cast, center, axis, [along, [0, 0, 1]], voxelM);
    const mean = plane.reduce((sum, { offset, lateral }) => [sum[0] + offset / plane.length, sum[1] + lateral / plane.length], [0, 0]);
    for (const { offset, lateral } of plane) {
      products += (offset - mean[0]) * (lateral - mean[1]);
      squares += (lateral - mean[1]) ** 2;
    }
  }
  return squares > 0 ? -Math.atan(products / squares) : 0;
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

/**
 * What a fan of rays meets of the wall in this direction. Only surface that faces it counts, and of that the plane which is met in
 * most columns of the fan: not what is seen through a door, nor furniture, over which the wall is seen in all of its width.
 */
function planeOf(cast: Cast, center: Vec3, axis: Vec3, across: [Vec3, Vec3], voxelM: number): Hit[] {
  for (const scale of NARROWER) {
    const hits = hitsOf(cast, center, axis, across, scale).sort((a, b) => a.offset - b.offset), plane = widest(hits, 2 * voxelM);
    if (plane.length >= LEAST_RAYS) return plane;
  }
  return [];
}

function hitsOf(cast: Cast, center: Vec3, axis: Vec3, across: [Vec3, Vec3], scale: number): Hit[] {
  const hits: Hit[] = [], [wide, high] = FAN;
  for (let i = -wide.steps; i <= wide.steps; ++i)
    for (let j = -high.steps; j <= high.steps; ++j) {
      const u = scale * wide.slope * i / wide.steps, v = scale * high.slope * j / high.steps;
      const way = [0, 1, 2].map(k => axis[k] + u * across[0][k] + v * across[1][k]), size = Math.hypot(...way);
      const surface = cast({ origin: center, direction: way.map(value => value / size) as Vec3 });
      if (surface && -dot(surface.normal, axis) > LEAST_FACING) hits.push({ offset: surface.distanceM / size, lateral: u * surface.distanceM / size, column: i, surface });
    }
  return hits;
}

function side(plane: Hit[], voxelM: number): Measured | null {
  if (plane.length === 0) return null;
  const value = median(plane.map(({ offset }) => offset));
  // Errors of neighbouring surface are alike: they do not average out.
  const error = median(plane.map(({ surface }) => (surface.errorM ?? voxelM / 2) + (surface.level > 0 ? voxelM : 0)));
  const spread = Math.sqrt(plane.reduce((sum, { offset }) => sum + (offset - value) ** 2, 0) / plane.length);
  return { value, sigma: Math.hypot(error, spread) };
}

/** Of hits, sorted by offset, those of most columns that lie within this thickness; of equally many columns the most hits. */
function widest(sorted: Hit[], thickness: number): Hit[] {
  const inside = new Map<number, number>();
  let best: [number, number] = [0, 0], mostColumns = 0;
  for (let begin = 0, end = 0; begin < sorted.length; ++begin) {
    for (; end < sorted.length && sorted[end].offset - sorted[begin].offset <= thickness; ++end)
      inside.set(sorted[end].column, (inside.get(sorted[end].column) ?? 0) + 1);
    if (inside.size > mostColumns || (inside.size === mostColumns && end - begin > best[1] - best[0])) [best, mostColumns] = [[begin, end], inside.size];
    const left = inside.get(sorted[begin].column)! - 1;
    if (left > 0) inside.set(sorted[begin].column, left);
    else inside.delete(sorted[begin].column);
  }
  return sorted.slice(...best);
}

const minus = (v: Vec3): Vec3 => [-v[0], -v[1], -v[2]];
const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

function median(values: number[]): number {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.floor(sorted.length / 2)];
}
