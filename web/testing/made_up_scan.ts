/** What a scan of the made-up house would send over time: a camera that walks through the rooms, and all that goes with it. */
import { deflateSync } from "node:zlib";
import { crc32 } from "./crc32.ts";
import * as encode from "./encode.ts";
import { ROOMS, type HousePage } from "./house.ts";
import type { Vec3 } from "../src/protocol/frames.ts";

const STOPS: Vec3[] = [[1, 1, 1.4], [3.1, 1.4, 1.4], [3.1, 3.1, 1.4], [2, 4.4, 1.4], [5.4, 4.4, 1.4], [5.5, 3.1, 1.4], [5.6, 1.5, 1.4], [6.6, 1, 1.4]];
const SPEED_M_S = 0.8;

/** Place and heading on the way through the rooms; it ends at the last stop. */
export function cameraAt(timeS: number): { position: Vec3; yaw: number } {
  let left = timeS * SPEED_M_S;
  for (let i = 0; i + 1 < STOPS.length; ++i) {
    const [a, b] = [STOPS[i], STOPS[i + 1]], size = Math.hypot(b[0] - a[0], b[1] - a[1]);
    if (left <= size || i + 2 === STOPS.length) {
      const share = Math.min(left / size, 1);
      const position = [0, 1, 2].map(k => a[k] + share * (b[k] - a[k])) as Vec3;
      return { position, yaw: Math.atan2(b[1] - a[1], b[0] - a[0]) + 0.8 * Math.sin(1.3 * timeS) };
    }
    left -= size;
  }
  return { position: STOPS[0], yaw: 0 };
}

/** Orientation of a camera that looks along its z axis, level, with this heading. */
export function lookAlong(yaw: number): [number, number, number, number] {
  // Rotation by columns: right (x), down (y), ahead (z).
  const a = Math.cos(yaw / 2 - Math.PI / 4) * Math.SQRT1_2, b = Math.sin(yaw / 2 - Math.PI / 4) * Math.SQRT1_2;
  return [-a, -b, b, a];
}

/** How far a page's middle is from the place. */
export function distanceTo(page: HousePage, sideM: number, place: Vec3): number {
  return Math.hypot(...page.key.map((value, k) => (value + 0.5) * sideM - place[k]));
}

export function trajectory(untilS: number, stepS = 0.2): number[] {
  const points: number[] = [];
  for (let time = 0; time <= untilS; time += stepS) {
    const { position } = cameraAt(time);
    points.push(position[0], position[1], position[2] + 0.03 * Math.sin(6 * time));
  }
  return points;
}

export function telemetryAt(timeS: number, share: number): object {
  const words = [
    timeS % 12 > 9 ? { level: "bad", text: "Too fast", number: "48 degrees a second, 30 is good" } : { level: "ok", text: "Going well", number: "94 % of the points are tracked" },
    ...(timeS % 20 > 12 ? [{ level: "warning", text: "Too near", number: "0.42 m, 0.6 m or more is good" }] : []),
  ];
  return {
    state: share < 1 ? "running" : "finished", progress: { done: Math.round(600 * share), total: 600, stage: "frame" }, words,
    coverage: { area_m2: 152 * share, share: 0.91 * share },
    ...(share < 1 ? {} : { verdict: { verdict: "ok", reasons: ["all frames tracked"] } }),
  };
}

export function statisticsAt(timeS: number, share: number): object {
  const wave = (size: number, rate: number): number => size * (1 + 0.3 * Math.sin(rate * timeS));
  return {
    time_s: timeS, stages: { track: wave(7, 1.7), integrate: wave(14, 0.9), mesh: wave(6, 2.3), send: wave(1.2, 3.1) },
    rates: { "frames read": 30, "frames tracked": wave(28, 0.4), "pages changed": wave(40, 0.7) },
    counts: { "frames dropped": Math.floor(timeS / 7), "frames refused": Math.floor(timeS / 19) },
    memory: { process: 1.2e8 + 9e7 * share, "voxels": 6e7 * share, "mesh": 2.5e7 * share },
    parameters: "[tsdf]\nvoxel_size_m = 0.05\nmax_weight = 255\n\n[mesh]\nbudget_ms = 8.0\n",
  };
}

/** Walls of the rooms at one height. Through the window of the second room nobody has seen anything. */
export function occupancyTile(): encode.Payload {
  const side = 80, cellM = 0.1, cells = new Uint8Array(side * side);
  for (const { low, high } of ROOMS)
    for (let y = 0; y < side; ++y)
      for (let x = 0; x < side; ++x) {
        const px = (x + 0.5) * cellM, py = (y + 0.5) * cellM;
        if (px > low[0] && px < high[0] && py > low[1] && py < high[1]) {
          const edge = Math.min(px - low[0], high[0] - px, py - low[1], high[1] - py);
          const isWindow = px > 7.3 && py > 1 && py < 2.2;
          cells[y * side + x] = edge < cellM && !isWindow ? 255 : 1;
        }
      }
  return encode.gridTile([0, 0], 1, cellM, 0.3, side, cells);
}

/** A picture of stripes that move, 160 x 120. */
export function pictureAt(which: number, timeS: number): encode.Payload {
  const [width, height] = [160, 120], rows = new Uint8Array(height * (1 + 3 * width));
  for (let y = 0; y < height; ++y)
    for (let x = 0; x < width; ++x) {
      const value = 127 + 120 * Math.sin(0.06 * x + 0.04 * y + timeS), at = y * (1 + 3 * width) + 1 + 3 * x;
      rows.set(which === 0 ? [value, 0.8 * value + 30, 0.6 * value + 40] : [255 - value, 60, value], at);
    }
  return encode.picture(which, 1, width, height, png(width, height, rows));
}

function png(width: number, height: number, rows: Uint8Array): Uint8Array {
  const chunk = (type: string, content: Uint8Array): Uint8Array => {
    const body = encode.pack(new TextEncoder().encode(type), content), size = new Uint8Array(4), check = new Uint8Array(4);
    new DataView(size.buffer).setUint32(0, content.length);
    new DataView(check.buffer).setUint32(0, crc32(body));
    return encode.pack(size, body, check);
  };
  const head = new Uint8Array(13), view = new DataView(head.buffer);
  view.setUint32(0, width);
  view.setUint32(4, height);
  head.set([8, 2, 0, 0, 0], 8);
  return encode.pack(Uint8Array.of(137, 80, 78, 71, 13, 10, 26, 10), chunk("IHDR", head), chunk("IDAT", deflateSync(rows)), chunk("IEND", new Uint8Array(0)));
}
