/** Reads what tests/page/codec_frames.cpp wrote, and compares it with what was meant. Throws where they differ. */
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { MeshoptDecoder } from "meshoptimizer/decoder";
import { readFrame, readHeader, type Frame } from "../src/protocol/frames.ts";
import { decodePage, octahedralNormal, type MeshPage } from "../src/protocol/mesh_page.ts";

const SIDE = 48;

function readMessages(path: string): Uint8Array[] {
  const bytes = readFileSync(path), messages: Uint8Array[] = [];
  for (let at = 0; at < bytes.length;) {
    const size = bytes.readUInt32LE(at);
    messages.push(new Uint8Array(bytes.subarray(at + 4, at + 4 + size)));
    at += 4 + size;
  }
  return messages;
}

/** Every vertex of the page is one of the mesh, to half a quantum, with its colour and about its normal; returns how many differ. */
function checkVertices(page: MeshPage, points: Float32Array, colors: Uint8Array): Set<number> {
  const met = new Set<number>();
  for (let i = 0; i < page.positions.length / 4; ++i) {
    // Red and green are five times the vertex's place in the grid.
    const [x, y] = [page.tints[4 * i] / 5, page.tints[4 * i + 1] / 5], vertex = SIDE * y + x;
    assert.deepEqual([...page.tints.subarray(4 * i, 4 * i + 3)], [...colors.subarray(16 * vertex + 12, 16 * vertex + 15)]);
    for (let k = 0; k < 3; ++k) {
      const error = page.origin[k] + page.quantum * page.positions[4 * i + k] - points[4 * vertex + k];
      assert.ok(Math.abs(error) <= page.quantum * 0.5 + 2e-7, `vertex ${i}: ${error / page.quantum} quanta`);
    }
    const [u, v] = [points[4 * vertex], points[4 * vertex + 1]];
    const slope = [-0.9 * Math.cos(9 * u) * Math.cos(7 * v), 0.7 * Math.sin(9 * u) * Math.sin(7 * v), 1], size = Math.hypot(...slope);
    const facing = octahedralNormal(page.positions[4 * i + 3]).reduce((sum, value, k) => sum + value * slope[k] / size, 0);
    if (x > 0 && y > 0 && x < SIDE - 1 && y < SIDE - 1) assert.ok(facing > Math.cos(0.05), `vertex ${i}: normal off by ${Math.acos(facing)} rad`);
    met.add(vertex);
  }
  return met;
}

function checkPages(frames: Frame[], folder: string): void {
  const raw = readFileSync(join(folder, "vertices.bin")), colors = new Uint8Array(raw), points = new Float32Array(colors.buffer, 0, raw.length / 4);
  const counts: number[] = [];
  frames.slice(0, 3).forEach((frame, level) => {
    assert.equal(frame.kind, "meshPage");
    if (frame.kind !== "meshPage") return;
    const page = decodePage(frame.page, MeshoptDecoder);
    assert.deepEqual([page.key, page.version, page.level, page.hasColors, page.ageS], [[1, -2, 0], 9, level, true, 2.5]);
    const met = checkVertices(page, points, colors);
    assert.equal(met.size, page.positions.length / 4);
    if (level === 0) assert.equal(met.size, SIDE * SIDE);
    for (let i = 0; i < SIDE; ++i) for (const vertex of [i, SIDE * i, SIDE * SIDE - 1 - i]) assert.ok(met.has(vertex), `level ${level} moved the border`);
    counts.push(page.indices.length / 3);
  });
  assert.equal(counts[0], 2 * (SIDE - 1) ** 2);
  assert.ok(counts[1] < 0.5 * counts[0] && counts[2] < counts[1], counts.join());
}

function checkOthers(frames: Frame[]): void {
  assert.deepEqual(frames.slice(3), [
    { kind: "pageGone", gone: { key: [-1, 2, -3], version: 10 } },
    { kind: "pose", stampNs: 1_500_000_000n, pose: {
      which: "vehicle", state: "lost", deviationM: 0.25, position: [1, -2, 3], quaternion: [-0.5, 0.5, -0.5, 0.5], halfFieldRad: [0.5, 0.375] } },
    { kind: "path", path: { which: 3, first: 2, total: 5, points: Float32Array.of(1, 2, 3, 4, 5, 6) } },
    { kind: "scan", scan: { which: "obstacles", points: Float32Array.of(7, 8, 9) } },
    { kind: "plan", plan: { state: "refused", reason: "wall, 2 m", points: Float32Array.of(0, 0, 1) } },
    { kind: "gridTile", tile: { key: [-1, 4], version: 3, cellM: 0.5, heightM: 1.25, side: 2, cells: Uint8Array.of(0, 1, 128, 255) } },
    { kind: "picture", picture: { which: "depth", type: "image/png", width: 320, height: 240, file: new TextEncoder().encode("file") } },
    { kind: "telemetry", telemetry: { state: "running" } },
  ]);
}

export async function check(folder: string): Promise<void> {
  await MeshoptDecoder.ready;
  const messages = readMessages(join(folder, "frames.bin"));
  messages.forEach((message, i) => assert.equal(readHeader(message).sequence, i + 1));
  const frames = messages.map(readFrame);
  checkPages(frames, folder);
  checkOthers(frames);
  console.log(`${frames.length} frames are as they were written`);
}
