import assert from "node:assert/strict";
import { test } from "node:test";
import { MeshoptEncoder } from "meshoptimizer";
import { MeshoptDecoder } from "meshoptimizer/decoder";
import * as encode from "../../testing/encode.ts";
import { makeHouse, ROOMS } from "../../testing/house.ts";
import { readFrame, type Vec3 } from "../protocol/frames.ts";
import { decodePage, type EncodedPage } from "../protocol/mesh_page.ts";
import { distance, heightDifference, polygonArea, type MeasuredPoint } from "./geometry.ts";
import { castRay, type Ray } from "./raycast.ts";
import { measureRoom, wallDirection } from "./room_size.ts";
import { makeRandom } from "../../testing/random.ts";

await Promise.all([MeshoptEncoder.ready, MeshoptDecoder.ready]);

/** The made-up house, turned about the z axis, as it comes through the wire. */
async function house(turn: number, level = 0) {
  const [c, s] = [Math.cos(turn), Math.sin(turn)], rotate = ([x, y, z]: Vec3): Vec3 => [c * x - s * y, s * x + c * y, z];
  return (await makeHouse(0.05, 0.1)).map(({ key, levels }) => {
    const vertices = levels[level].vertices.map(vertex => ({ ...vertex, point: rotate(vertex.point), normal: rotate(vertex.normal) }));
    const head = { key, version: 1, level, hasColors: true, origin: rotate(key.map(value => value * 1.6) as Vec3), quantum: 4e-4 / 4, ageS: 0 };
    const frame = readFrame(encode.frame(encode.meshPage(head, { vertices, indices: levels[level].indices }), 1));
    return decodePage((frame as { page: EncodedPage }).page, MeshoptDecoder);
  });
}

const straight = await house(0);
const unit = (v: Vec3): Vec3 => v.map(value => value / Math.hypot(...v)) as Vec3;

test("a ray meets the wall where it is, with its normal and expected error", () => {
  const hit = castRay(straight, { origin: [1, 1.5, 1.2], direction: [-1, 0, 0] })!;
  assert.ok(Math.abs(hit.distanceM - 1) < 1e-4);
  assert.ok(hit.point.every((value, k) => Math.abs(value - [0, 1.5, 1.2][k]) < 1e-4));
  assert.ok(hit.normal[0] > 0.999);
  assert.ok(hit.errorM! > 0.0015 && hit.errorM! < 0.0065);
});

test("where vertices have no normals, or rounded ones at an edge, the triangle's counts", () => {
  const bare = straight.map(page => ({ ...page, positions: page.positions.map((value, i) => i % 4 === 3 ? 0 : value) }));
  const hit = castRay(bare, { origin: [1, 1.5, 1.2], direction: [-1, 0, 0] })!;
  assert.ok(hit.normal[0] > 0.9999);
});

test("nearest of all pages: as a search over every triangle says, for rays in all directions", () => {
  let met = 0;
  for (let i = 0; i < 200; ++i) {
    const ray: Ray = { origin: [0.5 + 6.4 * (i * 0.618 % 1), 0.5 + 4.6 * (i * 0.414 % 1), 1.3], direction: unit([Math.cos(i), Math.sin(i), Math.sin(3 * i)]) };
    const one = castRay(straight, ray), each = straight.map(page => castRay([page], ray)?.distanceM ?? Infinity);
    const least = Math.min(...each);
    assert.equal(one?.distanceM ?? Infinity, least);
    if (one) ++met;
  }
  assert.ok(met > 150, String(met));
});

test("what lies above the clipping height is not met, nor what is too far", () => {
  const ray: Ray = { origin: [1, 1.5, 1.2], direction: [0, 0, 1] };
  assert.ok(Math.abs(castRay(straight, ray)!.distanceM - 1.4) < 1e-4);
  assert.equal(castRay(straight, ray, { clipHeightM: 2 }), null);
  assert.equal(castRay(straight, ray, { farM: 1.3 }), null);
});

test("walls are looked through from behind, unless their backs are shown", () => {
  const down: Ray = { origin: [1.01, 1.52, 5], direction: [0, 0, -1] };
  assert.ok(Math.abs(castRay(straight, down)!.distanceM - 5) < 1e-4);
  assert.ok(Math.abs(castRay(straight, down, { backSides: true })!.distanceM - 2.4) < 1e-4);
  assert.ok(Math.abs(castRay(straight, down, { backSides: true, clipHeightM: 2 })!.distanceM - 5) < 1e-4);
});

function pointOn(ray: Ray, pixelM = 0.002): MeasuredPoint {
  return { ...castRay(straight, ray)!, pixelM };
}

test("distance between walls: 4 m, uncertain by the errors of both", () => {
  const a = pointOn({ origin: [1, 1.53, 1.2], direction: [-1, 0, 0] }), b = pointOn({ origin: [1, 1.53, 1.2], direction: [1, 0, 0] });
  const { value, sigma } = distance(a, b, 0.05);
  assert.ok(Math.abs(value - 4) < 2e-4);
  assert.ok(Math.abs(sigma - Math.hypot(a.errorM!, b.errorM!)) < 1e-4);
  assert.ok(Math.abs(distance({ ...a, errorM: null }, { ...b, errorM: null }, 0.05).sigma - 0.025 * Math.SQRT2) < 1e-4);
  assert.ok(distance({ ...a, level: 2 }, b, 0.05).sigma > 0.05);
});

test("along the surface the aim counts, not the surface's error", () => {
  const a = pointOn({ origin: [1, 0.53, 1.2], direction: [-1, 0, 0] }), b = pointOn({ origin: [1, 2.53, 1.2], direction: [-1, 0, 0] });
  assert.ok(Math.abs(distance(a, b, 0.05).sigma - 0.002 * Math.SQRT2) < 1e-4);
});

test("height: from the floor to the ceiling 2.6 m", () => {
  const { value } = heightDifference(pointOn({ origin: [1, 1, 1], direction: [0, 0, -1] }), pointOn({ origin: [2, 2, 1], direction: [0, 0, 1] }), 0.05);
  assert.ok(Math.abs(value - 2.6) < 2e-4);
});

test("area: of a window-like and of an L-shaped polygon, whichever way round", () => {
  const on = (x: number, y: number): MeasuredPoint => pointOn({ origin: [x, y, 1], direction: [0, 0, -1] });
  const square = [on(1.01, 1.01), on(3.01, 1.01), on(3.01, 2.01), on(1.01, 2.01)];
  assert.ok(Math.abs(polygonArea(square, 0.05).value - 2) < 1e-3);
  assert.ok(Math.abs(polygonArea([...square].reverse(), 0.05).value - 2) < 1e-3);
  const corner = [on(1.01, 1.01), on(3.01, 1.01), on(3.01, 1.51), on(2.01, 1.51), on(2.01, 2.01), on(1.01, 2.01)];
  const { value, sigma } = polygonArea(corner, 0.05);
  assert.ok(Math.abs(value - 1.5) < 1e-3);
  assert.ok(sigma > 0.001 && sigma < 0.01, String(sigma));
});

test("the uncertainty of an area is that of corners shaken at random", () => {
  const on = (x: number, y: number): MeasuredPoint => pointOn({ origin: [x, y, 1], direction: [0, 0, -1] }, 0.01);
  const points = [on(1.01, 1.01), on(3.01, 1.01), on(3.01, 2.01), on(1.01, 2.01)], { value, sigma } = polygonArea(points, 0.05);
  let sum = 0;
  const random = makeRandom(5);
  const normal = (): number => Math.sqrt(-2 * Math.log(random() + 1e-12)) * Math.cos(2 * Math.PI * random());
  for (let round = 0; round < 4000; ++round) {
    const shaken = points.map(p => ({ ...p, point: [p.point[0] + 0.01 * normal(), p.point[1] + 0.01 * normal(), p.point[2]] as Vec3 }));
    sum += (polygonArea(shaken, 0.05).value - value) ** 2;
  }
  assert.ok(Math.abs(Math.sqrt(sum / 4000) / sigma - 1) < 0.1, `${Math.sqrt(sum / 4000)} ${sigma}`);
});

test("rooms: sizes to 2 mm, turned or not, also beside a door, on any level", async () => {
  for (const turn of [0, 0.35, -0.6])
    for (const level of [0, 2]) {
      const pages = turn || level ? await house(turn, level) : straight, cast = (ray: Ray) => castRay(pages, ray);
      const [c, s] = [Math.cos(turn), Math.sin(turn)];
      for (const { low, high } of ROOMS) {
        const [x, y] = [low[0] + 0.42 * (high[0] - low[0]), low[1] + 0.45 * (high[1] - low[1])], center: Vec3 = [c * x - s * y, s * x + c * y, 1.2];
        const room = measureRoom(cast, center, 0.05), sizes = room.sizes.map(size => size!.value);
        [0, 1, 2].forEach(k => assert.ok(Math.abs(sizes[k] - (high[k] - low[k])) < 0.002, `turned by ${turn}, level ${level}: ${sizes}`));
      }
    }
});

/** Rays from inside a room of axis-parallel boxes, the first of which is the room itself. */
function castInBoxes(boxes: [Vec3, Vec3][], ray: Ray): ReturnType<typeof castRay> {
  let best: { distanceM: number; normal: Vec3 } | null = null;
  boxes.forEach(([low, high], at) => {
    for (let k = 0; k < 3; ++k)
      for (const face of [low, high]) {
        const distanceM = (face[k] - ray.origin[k]) / ray.direction[k];
        const meets = [0, 1, 2].every(i => i === k || (ray.origin[i] + distanceM * ray.direction[i] >= low[i] && ray.origin[i] + distanceM * ray.direction[i] <= high[i]));
        const outwards = face === high ? 1 : -1, normal: Vec3 = [0, 0, 0];
        normal[k] = at === 0 ? -outwards : outwards;
        if (distanceM > 0 && meets && normal[k] * ray.direction[k] < 0 && distanceM < (best?.distanceM ?? Infinity)) best = { distanceM, normal };
      }
  });
  const hit = best as { distanceM: number; normal: Vec3 } | null;
  return hit && { ...hit, point: [0, 1, 2].map(i => ray.origin[i] + hit.distanceM * ray.direction[i]) as Vec3, errorM: 0.005, level: 0, quantumM: 1e-4 };
}

test("rooms: far walls are measured, and over the furniture before them", () => {
  const room: [Vec3, Vec3] = [[0, 0, 0], [8, 6.6, 2.7]], sofa: [Vec3, Vec3] = [[2.6, 0, 0], [5.2, 0.9, 1.5]], shelf: [Vec3, Vec3] = [[0, 1, 0], [0.4, 4, 2]];
  for (const center of [[6.4, 5.4, 1.2], [4, 3.3, 1.2], [3.5, 5.4, 1.2]] as Vec3[]) {
    const sizes = measureRoom(ray => castInBoxes([room, sofa, shelf], ray), center, 0.03).sizes.map(size => size?.value ?? 0);
    [8, 6.6, 2.7].forEach((size, k) => assert.ok(Math.abs(sizes[k] - size) < 0.002, `from ${center}: ${sizes}`));
  }
});

test("the direction of walls is between -45 and 45 degrees; without walls it is 0", async () => {
  const pages = await house(1.2);
  assert.ok(Math.abs(wallDirection(ray => castRay(pages, ray), [-0.9, 2.1, 1.2]) - (1.2 - Math.PI / 2)) < 0.01);
  assert.equal(wallDirection(() => null, [0, 0, 0]), 0);
  assert.deepEqual(measureRoom(() => null, [0, 0, 0], 0.05).sizes, [null, null, null]);
});
