/** Writes frames of the live view as the server does (docs/file_formats.md): what tests and the made-up server send. */
import { MeshoptEncoder } from "meshoptimizer";
import { HEADER_BYTES, Kind, PROTOCOL, type PageKey, type Vec3 } from "../src/protocol/frames.ts";

export interface Vertex { point: Vec3; normal: Vec3; color: Vec3; errorM: number | null }
export interface Surface { vertices: Vertex[]; indices: number[] }

type Part = ["u8" | "u16" | "u32" | "i32" | "f32" | "f64", ...number[]] | Uint8Array;
const SIZES = { u8: 1, u16: 2, u32: 4, i32: 4, f32: 4, f64: 8 };

/** Values one after the other, little endian. */
export function pack(...parts: Part[]): Uint8Array {
  const bytes = new Uint8Array(parts.reduce((sum, part) => sum + (part instanceof Uint8Array ? part.length : (part.length - 1) * SIZES[part[0]]), 0));
  const view = new DataView(bytes.buffer);
  let at = 0;
  for (const part of parts) {
    if (part instanceof Uint8Array) {
      bytes.set(part, at);
      at += part.length;
      continue;
    }
    const [type, ...values] = part;
    for (const value of values) {
      if (type === "u8") view.setUint8(at, value);
      else if (type === "u16") view.setUint16(at, value, true);
      else if (type === "u32") view.setUint32(at, value, true);
      else if (type === "i32") view.setInt32(at, value, true);
      else if (type === "f32") view.setFloat32(at, value, true);
      else view.setFloat64(at, value, true);
      at += SIZES[type];
    }
  }
  return bytes;
}

export interface Payload { kind: number; bytes: Uint8Array }

export function frame({ kind, bytes }: Payload, sequence: number, stampNs = 0n): Uint8Array {
  const header = pack(["u8", PROTOCOL, kind], ["u16", 0], ["u32", sequence]), stamp = new Uint8Array(8);
  new DataView(stamp.buffer).setBigInt64(0, stampNs, true);
  const whole = pack(header, stamp, bytes);
  if (header.length + 8 !== HEADER_BYTES) throw new Error("the header has another size");
  return whole;
}

const json = (kind: number, value: object): Payload => ({ kind, bytes: new TextEncoder().encode(JSON.stringify(value)) });
export const hello = (value: object): Payload => json(Kind.hello, value);
export const telemetry = (value: object): Payload => json(Kind.telemetry, value);
export const event = (value: object): Payload => json(Kind.event, value);
export const statistics = (value: object): Payload => json(Kind.statistics, value);

export const pageGone = (key: PageKey, version: number): Payload => ({ kind: Kind.pageGone, bytes: pack(["i32", ...key], ["u32", version]) });

export function pose(which: number, state: number, deviationM: number, position: Vec3, quaternion: number[], halfFieldRad: [number, number]): Payload {
  return { kind: Kind.pose, bytes: pack(["u8", which, state], ["u16", 0], ["f32", deviationM], ["f64", ...position], ["f32", ...quaternion, ...halfFieldRad]) };
}

export function path(which: number, first: number, total: number, points: number[]): Payload {
  return { kind: Kind.path, bytes: pack(["u8", which, 0, 0, 0], ["u32", first, total, points.length / 3], ["f32", ...points]) };
}

export function scan(which: number, points: number[]): Payload {
  return { kind: Kind.scan, bytes: pack(["u8", which, 0, 0, 0], ["u32", points.length / 3], ["f32", ...points]) };
}

export function plan(state: number, reason: string, points: number[]): Payload {
  const text = new TextEncoder().encode(reason);
  return { kind: Kind.plan, bytes: pack(["u8", state, 0, 0, 0], ["u32", text.length, points.length / 3], text, ["f32", ...points]) };
}

export function gridTile(key: [number, number], version: number, cellM: number, heightM: number, side: number, cells: Uint8Array): Payload {
  return { kind: Kind.gridTile, bytes: pack(["i32", ...key], ["u32", version], ["f32", cellM, heightM], ["u16", side, 0], cells) };
}

export function picture(which: number, format: number, width: number, height: number, file: Uint8Array): Payload {
  return { kind: Kind.picture, bytes: pack(["u8", which, format], ["u16", width, height, 0], file) };
}

const sign = (value: number): number => (value >= 0 ? 1 : -1);

/** Two signed bytes in 1/127. */
export function octahedralCode(normal: Vec3): [number, number] {
  const sum = Math.abs(normal[0]) + Math.abs(normal[1]) + Math.abs(normal[2]);
  let [u, v] = [normal[0] / sum, normal[1] / sum];
  if (normal[2] < 0) [u, v] = [(1 - Math.abs(v)) * sign(u), (1 - Math.abs(u)) * sign(v)];
  return [Math.round(127 * u) & 255, Math.round(127 * v) & 255];
}

export interface PageHead { key: PageKey; version: number; level: number; hasColors: boolean; origin: Vec3; quantum: number; ageS: number }

/** MeshoptEncoder.ready has to be awaited before. */
export function meshPage(head: PageHead, { vertices, indices }: Surface): Payload {
  const raw = new Uint8Array(12 * vertices.length), words = new Int16Array(raw.buffer);
  vertices.forEach(({ point, normal, color, errorM }, i) => {
    for (let k = 0; k < 3; ++k) words[6 * i + k] = Math.round((point[k] - head.origin[k]) / head.quantum);
    raw.set(octahedralCode(normal), 12 * i + 6);
    raw.set(color, 12 * i + 8);
    raw[12 * i + 11] = errorM === null ? 255 : Math.min(Math.round(errorM / 0.0005), 254);
  });
  const list = Uint32Array.from(indices);
  const encodedVertices = MeshoptEncoder.encodeVertexBuffer(raw, vertices.length, 12);
  const encodedIndices = MeshoptEncoder.encodeIndexBuffer(new Uint8Array(list.buffer), list.length, 4);
  return { kind: Kind.meshPage, bytes: pack(
    ["i32", ...head.key], ["u32", head.version], ["u8", head.level, head.hasColors ? 1 : 0], ["u16", 0],
    ["u32", vertices.length, list.length, encodedVertices.length, encodedIndices.length], ["f32", ...head.origin, head.quantum, head.ageS],
    encodedVertices, encodedIndices) };
}
