import { FrameError, Reader } from "./reader.ts";
import { readMeshPage, type EncodedPage } from "./mesh_page.ts";
import type { Hello, LiveEvent, Statistics, Telemetry } from "./messages.ts";

export const PROTOCOL = 1;
export const HEADER_BYTES = 16;

/** Kinds of frames (docs/file_formats.md, Frames of /live). */
export const Kind = {
  hello: 1, meshPage: 2, pageGone: 3, pose: 4, path: 5, scan: 6, plan: 7, gridTile: 8, telemetry: 9, event: 10,
  picture: 11, statistics: 12,
} as const;

export interface Header { kind: number; sequence: number; stampNs: bigint }
export type Vec3 = [number, number, number];
export type PageKey = Vec3;
export interface Box { low: Vec3; high: Vec3 }

export interface PageGone { key: PageKey; version: number }
export interface Pose {
  which: "camera" | "vehicle";
  state: "tracked" | "lost" | "estimated";
  deviationM: number;  // NaN: unknown
  position: Vec3;
  quaternion: [number, number, number, number];  // x, y, z, w
  halfFieldRad: [number, number];  // 0: none
}
export const PATH_NAMES = ["trajectory", "keyframes", "truth", "way points"] as const;
export interface Path { which: number; first: number; total: number; points: Float32Array }
export interface Scan { which: "laser" | "obstacles"; points: Float32Array }
export interface Plan { state: "none" | "valid" | "refused"; reason: string; points: Float32Array }
export interface GridTile { key: [number, number]; version: number; cellM: number; heightM: number; side: number; cells: Uint8Array }
export interface Picture { which: "colour" | "depth"; type: "image/jpeg" | "image/png"; width: number; height: number; file: Uint8Array }

export type Frame =
  | { kind: "hello"; hello: Hello }
  | { kind: "meshPage"; page: EncodedPage }
  | { kind: "pageGone"; gone: PageGone }
  | { kind: "pose"; pose: Pose; stampNs: bigint }
  | { kind: "path"; path: Path }
  | { kind: "scan"; scan: Scan }
  | { kind: "plan"; plan: Plan }
  | { kind: "gridTile"; tile: GridTile }
  | { kind: "telemetry"; telemetry: Telemetry }
  | { kind: "event"; event: LiveEvent }
  | { kind: "picture"; picture: Picture }
  | { kind: "statistics"; statistics: Statistics }
  | { kind: "unknown"; number: number };

/** Throws FrameError where the version is another or bytes are missing. */
export function readHeader(bytes: Uint8Array): Header {
  const reader = new Reader(bytes), version = reader.u8();
  if (version !== PROTOCOL) throw new FrameError(`the server speaks version ${version} of the protocol, this page ${PROTOCOL}`);
  const kind = reader.u8();
  reader.skip(2);
  return { kind, sequence: reader.u32(), stampNs: reader.i64() };
}

/** The frame of a whole message, header included; an unknown kind is no error. Throws FrameError for all else that is wrong. */
export function readFrame(bytes: Uint8Array): Frame {
  const { kind, stampNs } = readHeader(bytes), reader = new Reader(bytes.subarray(HEADER_BYTES));
  switch (kind) {
    case Kind.hello: return { kind: "hello", hello: readHello(reader) };
    case Kind.meshPage: return { kind: "meshPage", page: readMeshPage(reader) };
    case Kind.pageGone: return { kind: "pageGone", gone: closed(reader, { key: readKey(reader), version: reader.u32() }) };
    case Kind.pose: return { kind: "pose", pose: readPose(reader), stampNs };
    case Kind.path: return { kind: "path", path: readPath(reader) };
    case Kind.scan: return { kind: "scan", scan: readScan(reader) };
    case Kind.plan: return { kind: "plan", plan: readPlan(reader) };
    case Kind.gridTile: return { kind: "gridTile", tile: readTile(reader) };
    case Kind.telemetry: return { kind: "telemetry", telemetry: readObject(reader) };
    case Kind.event: return { kind: "event", event: readEvent(reader) };
    case Kind.picture: return { kind: "picture", picture: readPicture(reader) };
    case Kind.statistics: return { kind: "statistics", statistics: readObject(reader) };
    default: return { kind: "unknown", number: kind };
  }
}

export function readKey(reader: Reader): PageKey { return [reader.i32(), reader.i32(), reader.i32()]; }

function closed<T>(reader: Reader, value: T): T {
  reader.end();
  return value;
}

function named<T>(names: readonly T[], index: number, what: string): T {
  const name = names[index];
  if (name === undefined) throw new FrameError(`${what} ${index} is unknown`);
  return name;
}

function readObject<T extends object>(reader: Reader): T {
  let value: unknown;
  try {
    value = JSON.parse(reader.text(reader.left));
  } catch (error) {
    throw new FrameError(`JSON: ${(error as Error).message}`);
  }
  if (typeof value !== "object" || value === null || Array.isArray(value)) throw new FrameError("JSON: no object");
  return value as T;
}

function readHello(reader: Reader): Hello {
  const hello = readObject<Hello>(reader);
  if (hello.protocol !== PROTOCOL) throw new FrameError(`the server speaks version ${hello.protocol} of the protocol, this page ${PROTOCOL}`);
  if (typeof hello.session !== "string" || typeof hello.can !== "object" || typeof hello.source !== "object")
    throw new FrameError("hello lacks session, source or can");
  return hello;
}

function readEvent(reader: Reader): LiveEvent {
  const event = readObject<LiveEvent>(reader);
  if (typeof event.id !== "number" || typeof event.text !== "string") throw new FrameError("an event lacks id or text");
  return event;
}

function readPose(reader: Reader): Pose {
  const which = named(["camera", "vehicle"] as const, reader.u8(), "pose");
  const state = named(["tracked", "lost", "estimated"] as const, reader.u8(), "state of a pose");
  reader.skip(2);
  return closed(reader, {
    which, state, deviationM: reader.f32(), position: [reader.f64(), reader.f64(), reader.f64()],
    quaternion: [reader.f32(), reader.f32(), reader.f32(), reader.f32()], halfFieldRad: [reader.f32(), reader.f32()],
  });
}

function readPath(reader: Reader): Path {
  const which = reader.u8();
  named(PATH_NAMES, which, "path");
  reader.skip(3);
  const first = reader.u32(), total = reader.u32(), points = reader.points(reader.u32());
  if (first + points.length / 3 > total) throw new FrameError("a path has more points than its total");
  return closed(reader, { which, first, total, points });
}

function readScan(reader: Reader): Scan {
  const which = named(["laser", "obstacles"] as const, reader.u8(), "scan");
  reader.skip(3);
  return closed(reader, { which, points: reader.points(reader.u32()) });
}

function readPlan(reader: Reader): Plan {
  const state = named(["none", "valid", "refused"] as const, reader.u8(), "state of a plan");
  reader.skip(3);
  const textBytes = reader.u32(), count = reader.u32(), reason = reader.text(textBytes);
  return closed(reader, { state, reason, points: reader.points(count) });
}

function readTile(reader: Reader): GridTile {
  const key: [number, number] = [reader.i32(), reader.i32()], version = reader.u32();
  const cellM = reader.f32(), heightM = reader.f32(), side = reader.u16();
  reader.skip(2);
  if (!(cellM > 0)) throw new FrameError(`a grid tile has cells of ${cellM} m`);
  return closed(reader, { key, version, cellM, heightM, side, cells: reader.part(side * side).slice() });
}

function readPicture(reader: Reader): Picture {
  const which = named(["colour", "depth"] as const, reader.u8(), "picture");
  const type = named(["image/jpeg", "image/png"] as const, reader.u8(), "format of a picture");
  const width = reader.u16(), height = reader.u16();
  reader.skip(2);
  return { which, type, width, height, file: reader.part(reader.left).slice() };
}
