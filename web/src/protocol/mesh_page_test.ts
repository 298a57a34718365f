import assert from "node:assert/strict";
import { test } from "node:test";
import { MeshoptEncoder } from "meshoptimizer";
import { MeshoptDecoder } from "meshoptimizer/decoder";
import * as encode from "../../testing/encode.ts";
import { makeHouse } from "../../testing/house.ts";
import { readFrame, type Vec3 } from "./frames.ts";
import { decodePage, octahedralNormal, type EncodedPage, type MeshPage } from "./mesh_page.ts";
import { FrameError } from "./reader.ts";
import { makeRandom } from "../../testing/random.ts";

await Promise.all([MeshoptEncoder.ready, MeshoptDecoder.ready]);

const HEAD: encode.PageHead = { key: [1, -2, 3], version: 7, level: 1, hasColors: true, origin: [1.6, -3.2, 4.8], quantum: 1e-4, ageS: 2.5 };
const SURFACE: encode.Surface = {
  vertices: [[0, 0, 0], [1, 0.5, 0], [0, 1, 0.25], [-0.3, 0.2, 0.7]].map((offset, i) => ({
    point: offset.map((value, k) => HEAD.origin[k] + value) as Vec3, normal: [[0, 0, 1], [0.6, 0, -0.8], [-1, 0, 0], [0.577, 0.577, -0.577]][i] as Vec3,
    color: [10 * i, 255 - i, 7] as Vec3, errorM: i === 3 ? null : 0.004,
  })),
  indices: [0, 1, 2, 0, 2, 3],
};

function roundTrip(head: encode.PageHead, surface: encode.Surface): MeshPage {
  const frame = readFrame(encode.frame(encode.meshPage(head, surface), 1));
  assert.equal(frame.kind, "meshPage");
  return decodePage((frame as { page: EncodedPage }).page, MeshoptDecoder);
}

test("a page comes back: head, positions to half a quantum, normals, colours, errors", () => {
  const page = roundTrip(HEAD, SURFACE);
  assert.deepEqual([page.key, page.version, page.level, page.hasColors, page.ageS], [[1, -2, 3], 7, 1, true, 2.5]);
  SURFACE.vertices.forEach(({ point, normal, color, errorM }, i) => {
    point.forEach((value, k) => assert.ok(Math.abs(page.origin[k] + page.quantum * page.positions[4 * i + k] - value) <= page.quantum * 0.502));
    octahedralNormal(page.positions[4 * i + 3]).forEach((value, k) => assert.ok(Math.abs(value - normal[k]) < 0.02, `${value} ${normal[k]}`));
    assert.deepEqual([...page.tints.subarray(4 * i, 4 * i + 4)], [...color, errorM === null ? 255 : 8]);
  });
  assert.deepEqual([...page.indices], SURFACE.indices);
  assert.ok(Math.abs(page.low[0] - 1.3) < 1e-3 && Math.abs(page.high[2] - 5.5) < 1e-3);
});

test("octahedral codes of all directions come back within a degree", () => {
  for (let i = 0; i < 500; ++i) {
    const z = 2 * (i + 0.5) / 500 - 1, turn = 2.4 * i, r = Math.sqrt(1 - z * z), normal: Vec3 = [r * Math.cos(turn), r * Math.sin(turn), z];
    const [u, v] = encode.octahedralCode(normal), back = octahedralNormal(u | v << 8);
    assert.ok(normal.reduce((sum, value, k) => sum + value * back[k], 0) > Math.cos(Math.PI / 180), normal.join());
  }
});

test("an empty page is a page", () => {
  const page = roundTrip(HEAD, { vertices: [], indices: [] });
  assert.deepEqual([page.positions.length, page.indices.length], [0, 0]);
});

test("more than 65,536 vertices get longer indices", () => {
  const vertices = Array.from({ length: 65538 }, () => SURFACE.vertices[0]);
  const page = roundTrip(HEAD, { vertices, indices: [0, 65536, 65537] });
  assert.ok(page.indices instanceof Uint32Array);
  assert.deepEqual([...page.indices], [0, 65536, 65537]);
});

test("every prefix, and damage of the encoded parts, is refused or decoded, and never beyond the vertices", () => {
  const whole = encode.frame(encode.meshPage(HEAD, SURFACE), 1);
  for (let size = 0; size < whole.length; ++size) assert.throws(() => readFrame(whole.subarray(0, size)), FrameError);
  let refused = 0;
  const uniform = makeRandom(7), random = (below: number): number => Math.floor(below * uniform());
  for (let round = 0; round < 2000; ++round) {
    const bytes = whole.slice();
    bytes[16 + random(bytes.length - 16)] = random(256);
    try {
      const frame = readFrame(bytes);
      if (frame.kind !== "meshPage") continue;
      const page = decodePage(frame.page, MeshoptDecoder);
      assert.ok(page.indices.every(index => index < page.positions.length / 4));
    } catch (error) {
      assert.ok(error instanceof FrameError, String(error));
      ++refused;
    }
  }
  assert.ok(refused > 200, `${refused} of 2000`);
});

test("all pages of the made-up house come back in all levels", async () => {
  for (const { key, levels } of await makeHouse(0.05, 0.1))
    levels.forEach((surface, level) => {
      const origin = key.map(value => value * 1.6) as Vec3, page = roundTrip({ ...HEAD, key, level, origin, quantum: 1.6 / 30000 }, surface);
      surface.vertices.forEach(({ point }, i) => point.forEach((value, k) =>
        assert.ok(Math.abs(page.origin[k] + page.quantum * page.positions[4 * i + k] - value) <= page.quantum * 0.51)));
      // The codec may begin a triangle with another of its corners.
      const turned = (list: ArrayLike<number>): string[] => Array.from({ length: list.length / 3 }, (_, i) => {
        const corners = [list[3 * i], list[3 * i + 1], list[3 * i + 2]], least = corners.indexOf(Math.min(...corners));
        return [corners[least], corners[(least + 1) % 3], corners[(least + 2) % 3]].join();
      });
      assert.deepEqual(turned(page.indices), turned(surface.indices));
    });
});
