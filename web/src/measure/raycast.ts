import type { Vec3 } from "../protocol/frames.ts";
import { octahedralNormal, type MeshPage } from "../protocol/mesh_page.ts";

/** A point of the surface. */
export interface SurfacePoint {
  point: Vec3;            // m
  normal: Vec3;           // unit, of the triangle's vertices
  distanceM: number;      // from the ray's origin
  errorM: number | null;  // expected error of the surface along its normal; null: unknown
  level: number;          // of the page
  quantumM: number;       // what positions of the page are rounded to
}

const LEAST_AGREEMENT = 0.7;

export interface Ray { origin: Vec3; direction: Vec3 }

/** What a ray meets: surface below `clipHeightM`, nearer than `farM`, also from behind where `backSides` is set. */
export interface RayLimits { clipHeightM?: number; farM?: number; backSides?: boolean }

/** The nearest surface that the ray meets, or null. */
export function castRay(pages: Iterable<MeshPage>, ray: Ray, limits: RayLimits = {}): SurfacePoint | null {
  const { farM = Infinity } = limits;
  const met: { page: MeshPage; nearM: number }[] = [];
  for (const page of pages) {
    const nearM = enterBox(page, ray);
    if (nearM < farM) met.push({ page, nearM });
  }
  met.sort((a, b) => a.nearM - b.nearM);
  let best: SurfacePoint | null = null, bestM = farM;
  for (const { page, nearM } of met) {
    if (nearM > bestM) break;
    const hit = castIntoPage(page, ray, limits, bestM);
    if (hit) [best, bestM] = [hit, hit.distanceM];
  }
  return best;
}

/** Distance at which the ray enters the page's box; Infinity: never. */
function enterBox({ low, high }: MeshPage, { origin, direction }: Ray): number {
  let near = 0, far = Infinity;
  for (let k = 0; k < 3; ++k) {
    const a = (low[k] - 1e-6 - origin[k]) / direction[k], b = (high[k] + 1e-6 - origin[k]) / direction[k];
    if (Number.isNaN(a) || Number.isNaN(b)) continue;
    near = Math.max(near, Math.min(a, b));
    far = Math.min(far, Math.max(a, b));
  }
  return near <= far ? near : Infinity;
}

/** Moeller and Trumbore's intersection, in quanta from the page's origin. */
function castIntoPage(page: MeshPage, ray: Ray, { clipHeightM = Infinity, backSides = false }: RayLimits, farM: number): SurfacePoint | null {
  const { positions: p, indices, quantum, origin } = page;
  const [ox, oy, oz] = [0, 1, 2].map(k => (ray.origin[k] - origin[k]) / quantum);
  const [dx, dy, dz] = ray.direction, clip = (clipHeightM - origin[2]) / quantum;
  let best = farM / quantum, found = -1, bestU = 0, bestV = 0;
  for (let i = 0; i < indices.length; i += 3) {
    const a = 4 * indices[i], b = 4 * indices[i + 1], c = 4 * indices[i + 2];
    const e1x = p[b] - p[a], e1y = p[b + 1] - p[a + 1], e1z = p[b + 2] - p[a + 2];
    const e2x = p[c] - p[a], e2y = p[c + 1] - p[a + 1], e2z = p[c + 2] - p[a + 2];
    const hx = dy * e2z - dz * e2y, hy = dz * e2x - dx * e2z, hz = dx * e2y - dy * e2x;
    const det = e1x * hx + e1y * hy + e1z * hz;
    if (det === 0 || (det < 0 && !backSides)) continue;  // from behind it is below 0
    const sx = ox - p[a], sy = oy - p[a + 1], sz = oz - p[a + 2], u = (sx * hx + sy * hy + sz * hz) / det;
    if (u < -1e-7 || u > 1 + 1e-7) continue;
    const qx = sy * e1z - sz * e1y, qy = sz * e1x - sx * e1z, qz = sx * e1y - sy * e1x;
    const v = (dx * qx + dy * qy + dz * qz) / det;
    if (v < -1e-7 || u + v > 1 + 1e-7) continue;
    const t = (e2x * qx + e2y * qy + e2z * qz) / det;
    if (t > 0 && t < best && oz + t * dz <= clip) [best, found, bestU, bestV] = [t, i, u, v];
  }
  return found < 0 ? null : surfacePoint(page, ray, found, best * quantum, [1 - bestU - bestV, bestU, bestV]);
}

function surfacePoint(page: MeshPage, ray: Ray, triangle: number, distanceM: number, weights: Vec3): SurfacePoint {
  const smooth: Vec3 = [0, 0, 0];
  let error = 0, known = true;
  for (let i = 0; i < 3; ++i) {
    const vertex = page.indices[triangle + i], own = octahedralNormal(page.positions[4 * vertex + 3]), code = page.tints[4 * vertex + 3];
    for (let k = 0; k < 3; ++k) smooth[k] += weights[i] * own[k];
    known &&= code !== 255;
    error += weights[i] * code * 0.0005;
  }
  return {
    point: [0, 1, 2].map(k => ray.origin[k] + distanceM * ray.direction[k]) as Vec3, normal: trusted(smooth, flatNormal(page, triangle)),
    distanceM, errorM: known ? error : null, level: page.level, quantumM: page.quantum,
  };
}

/** The vertices' normal, smoother than the triangle's; but that where they contradict each other: at edges, and in meshes without normals. */
function trusted(smooth: Vec3, flat: Vec3): Vec3 {
  const size = Math.hypot(...smooth), agreement = smooth.reduce((sum, value, k) => sum + value * flat[k], 0);
  return agreement > LEAST_AGREEMENT * size ? smooth.map(value => value / size) as Vec3 : flat;
}

function flatNormal({ positions: p, indices }: MeshPage, triangle: number): Vec3 {
  const [a, b, c] = [0, 1, 2].map(i => 4 * indices[triangle + i]);
  const [ux, uy, uz] = [0, 1, 2].map(k => p[b + k] - p[a + k]), [vx, vy, vz] = [0, 1, 2].map(k => p[c + k] - p[a + k]);
  const normal = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx], size = Math.hypot(...normal) || 1;
  return normal.map(value => value / size) as Vec3;
}
