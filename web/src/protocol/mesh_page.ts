import { FrameError, type Reader } from "./reader.ts";
import type { PageKey, Vec3 } from "./frames.ts";

export const VERTEX_BYTES = 12;
const MOST_VERTICES = 1 << 22, MOST_INDICES = 1 << 24;

/** A mesh page as it was sent: vertices and indices still in meshoptimizer's encodings. */
export interface EncodedPage {
  key: PageKey;
  version: number;
  level: number;  // 0 fine, 2 coarse
  hasColors: boolean;
  vertexCount: number;
  indexCount: number;
  origin: Vec3;    // m
  quantum: number; // m
  ageS: number;
  vertices: Uint8Array;
  indices: Uint8Array;
}

/** A decoded page, laid out for the graphics card; its three arrays share one buffer. */
export interface MeshPage {
  key: PageKey;
  version: number;
  level: number;
  hasColors: boolean;
  origin: Vec3;
  quantum: number;
  ageS: number;
  /** Four a vertex: x, y, z in quanta from the origin, and the octahedral normal's bytes u + 256 v. */
  positions: Int16Array;
  /** Four a vertex: red, green, blue, error in half millimetres (255: unknown). */
  tints: Uint8Array;
  indices: Uint16Array | Uint32Array;
  low: Vec3;   // box of the vertices, m
  high: Vec3;
}

/** The part of npm's meshoptimizer that is used. */
export interface PageDecoder {
  decodeVertexBuffer(target: Uint8Array, count: number, size: number, source: Uint8Array): void;
  decodeIndexBuffer(target: Uint8Array, count: number, size: number, source: Uint8Array): void;
}

const QUANTA_PER_VOXEL = 256;
/** Edge of a voxel of the page's map, m; of pages with triangles that reach far out, a multiple of it. */
export const voxelOf = (page: { quantum: number }): number => QUANTA_PER_VOXEL * page.quantum;

/** Reads a mesh page's payload without decoding it. */
export function readMeshPage(reader: Reader): EncodedPage {
  const key: PageKey = [reader.i32(), reader.i32(), reader.i32()], version = reader.u32();
  const level = reader.u8(), flags = reader.u8();
  reader.skip(2);
  const vertexCount = reader.u32(), indexCount = reader.u32(), vertexBytes = reader.u32(), indexBytes = reader.u32();
  const origin: Vec3 = [reader.f32(), reader.f32(), reader.f32()], quantum = reader.f32(), ageS = reader.f32();
  if (level > 2) throw new FrameError(`level ${level} of a page is unknown`);
  if (vertexCount > MOST_VERTICES || indexCount > MOST_INDICES || indexCount % 3 !== 0)
    throw new FrameError(`a page of ${vertexCount} vertices and ${indexCount} indices`);
  if (!(quantum > 0)) throw new FrameError(`a page with a quantum of ${quantum} m`);
  const vertices = reader.part(vertexBytes), indices = reader.part(indexBytes);
  reader.end();
  return { key, version, level, hasColors: (flags & 1) !== 0, vertexCount, indexCount, origin, quantum, ageS, vertices, indices };
}

/** Memory for what is decoded of one page after the other; made anew, larger, where a page needs more. */
class Scratch {
  private bytes = new Uint8Array(1 << 16);

  take(count: number): Uint8Array<ArrayBuffer> {
    if (count > this.bytes.length) this.bytes = new Uint8Array(Math.max(count, 2 * this.bytes.length));
    return this.bytes.subarray(0, count);
  }
}
const vertexScratch = new Scratch(), indexScratch = new Scratch();

/** Decodes vertices and indices; throws FrameError where they are damaged. */
export function decodePage(page: EncodedPage, decoder: PageDecoder): MeshPage {
  const { vertexCount, indexCount } = page, vertices = vertexScratch.take(vertexCount * VERTEX_BYTES), wide = indexScratch.take(4 * indexCount);
  try {
    decoder.decodeVertexBuffer(vertices, vertexCount, VERTEX_BYTES, page.vertices);
    decoder.decodeIndexBuffer(wide, indexCount, 4, page.indices);
  } catch (error) {
    throw new FrameError(`page ${page.key.join(", ")}: ${(error as Error).message}`);
  }
  // One buffer a page: to make one, to hand it over and to free it takes its time, however small it is.
  const isShort = vertexCount <= 65536, buffer = new ArrayBuffer(VERTEX_BYTES * vertexCount + (isShort ? 2 : 4) * indexCount);
  const positions = new Int16Array(buffer, 0, 4 * vertexCount), tints = new Uint8Array(buffer, 8 * vertexCount, 4 * vertexCount);
  const indices = isShort ? new Uint16Array(buffer, VERTEX_BYTES * vertexCount, indexCount) : new Uint32Array(buffer, VERTEX_BYTES * vertexCount, indexCount);
  copyIndices(new Uint32Array(wide.buffer, 0, indexCount), indices, page);
  const { low, high } = splitVertices(new Uint32Array(vertices.buffer, 0, 3 * vertexCount), positions, new Uint32Array(buffer, 8 * vertexCount, vertexCount));
  const metres = (quanta: Vec3): Vec3 => [0, 1, 2].map(k => page.origin[k] + page.quantum * quanta[k]) as Vec3;
  return {
    key: page.key, version: page.version, level: page.level, hasColors: page.hasColors, origin: page.origin,
    quantum: page.quantum, ageS: page.ageS, positions, tints, low: metres(low), high: metres(high), indices,
  };
}

/** By a loop: constructors of typed arrays convert several times slower. */
function copyIndices(from: Uint32Array, to: Uint16Array | Uint32Array, { key, vertexCount }: EncodedPage): void {
  let most = 0;
  for (let i = 0; i < from.length; ++i) {
    const index = from[i];
    to[i] = index;
    if (index > most) most = index;
  }
  if (from.length > 0 && most >= vertexCount) throw new FrameError(`page ${key.join(", ")}: index ${most} of ${vertexCount} vertices`);
}

/** Three words a vertex -> two of positions and one of colours; the box in quanta. */
function splitVertices(words: Uint32Array, positions: Int16Array, colors: Uint32Array): { low: Vec3; high: Vec3 } {
  const places = new Uint32Array(positions.buffer, positions.byteOffset, positions.length / 2);
  for (let i = 0; i < colors.length; ++i) {
    places[2 * i] = words[3 * i];
    places[2 * i + 1] = words[3 * i + 1];
    colors[i] = words[3 * i + 2];
  }
  const low: Vec3 = [0, 0, 0], high: Vec3 = [0, 0, 0];
  for (let k = 0; k < 3 && colors.length > 0; ++k) {
    let least = positions[k], most = least;
    for (let i = k; i < positions.length; i += 4) {
      const value = positions[i];
      if (value < least) least = value;
      if (value > most) most = value;
    }
    low[k] = least;
    high[k] = most;
  }
  return { low, high };
}

/** Unit normal of an octahedral code: two signed bytes in 1/127. */
export function octahedralNormal(code: number): Vec3 {
  const u = (code << 24 >> 24) / 127, v = (code << 16 >> 24) / 127, z = 1 - Math.abs(u) - Math.abs(v);
  const fold = Math.max(-z, 0);
  const x = u + (u >= 0 ? -fold : fold), y = v + (v >= 0 ? -fold : fold), length = Math.hypot(x, y, z);
  return [x / length, y / length, z / length];
}
