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

/** A decoded page, laid out for the graphics card. */
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

/** Decodes vertices and indices; throws FrameError where they are damaged. */
export function decodePage(page: EncodedPage, decoder: PageDecoder): MeshPage {
  const vertices = new Uint8Array(page.vertexCount * VERTEX_BYTES), indices = new Uint32Array(page.indexCount);
  try {
    decoder.decodeVertexBuffer(vertices, page.vertexCount, VERTEX_BYTES, page.vertices);
    decoder.decodeIndexBuffer(new Uint8Array(indices.buffer), page.indexCount, 4, page.indices);
  } catch (error) {
    throw new FrameError(`page ${page.key.join(", ")}: ${(error as Error).message}`);
  }
  for (let i = 0; i < indices.length; ++i)
    if (indices[i] >= page.vertexCount) throw new FrameError(`page ${page.key.join(", ")}: index ${indices[i]} of ${page.vertexCount} vertices`);
  const { positions, tints, low, high } = splitVertices(vertices, page.vertexCount);
  const metres = (quanta: Vec3): Vec3 => [0, 1, 2].map(k => page.origin[k] + page.quantum * quanta[k]) as Vec3;
  return {
    key: page.key, version: page.version, level: page.level, hasColors: page.hasColors, origin: page.origin,
    quantum: page.quantum, ageS: page.ageS, positions, tints, low: metres(low), high: metres(high),
    indices: page.vertexCount <= 65536 ? shortened(indices) : indices,
  };
}

/** The same in 16 bits, by a loop: constructors of typed arrays convert several times slower. */
function shortened(indices: Uint32Array): Uint16Array {
  const result = new Uint16Array(indices.length);
  for (let i = 0; i < result.length; ++i) result[i] = indices[i];
  return result;
}

/** Bytes of 12 a vertex -> two arrays of four a vertex, and the box in quanta. `vertices` begins at a multiple of four bytes. */
function splitVertices(vertices: Uint8Array, count: number) {
  const words = new Uint32Array(vertices.buffer, vertices.byteOffset, 3 * count);
  const positions = new Int16Array(4 * count), tints = new Uint8Array(4 * count);
  const places = new Uint32Array(positions.buffer), colors = new Uint32Array(tints.buffer);
  for (let i = 0; i < count; ++i) {
    places[2 * i] = words[3 * i];
    places[2 * i + 1] = words[3 * i + 1];
    colors[i] = words[3 * i + 2];
  }
  const low: Vec3 = [0, 0, 0], high: Vec3 = [0, 0, 0];
  for (let k = 0; k < 3 && count > 0; ++k) {
    let least = positions[k], most = least;
    for (let i = k; i < positions.length; i += 4) {
      const value = positions[i];
      if (value < least) least = value;
      if (value > most) most = value;
    }
    low[k] = least;
    high[k] = most;
  }
  return { positions, tints, low, high };
}

/** Unit normal of an octahedral code: two signed bytes in 1/127. */
export function octahedralNormal(code: number): Vec3 {
  const u = (code << 24 >> 24) / 127, v = (code << 16 >> 24) / 127, z = 1 - Math.abs(u) - Math.abs(v);
  const fold = Math.max(-z, 0);
  const x = u + (u >= 0 ? -fold : fold), y = v + (v >= 0 ? -fold : fold), length = Math.hypot(x, y, z);
  return [x / length, y / length, z / length];
}
