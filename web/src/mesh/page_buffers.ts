import type { MeshPage } from "../protocol/mesh_page.ts";
import { BlockList, type Run } from "./block_list.ts";
import { BLOCK_VERTICES, PAGES_UNIT, POSITION, TINT } from "./mesh_shader.ts";

const BLOCK_INDICES = 6 * BLOCK_VERTICES;  // a closed surface has six indices a vertex
const BLOCK_TEXELS = 8;  // numbers of the two texels of a block of vertices
/** Blocks of a buffer: 256 k vertices and their triangles. Of a page that has more, its own buffer has as many as it needs. */
const BUFFER_BLOCKS = 2048;

/** Where a page lies on the graphics card. */
export interface Placed { buffer: PageBuffer; vertices: Run[]; indices: Run[]; indexCount: number }

const blocksOf = (count: number, size: number): number => Math.max(Math.ceil(count / size), 1);

/** Pages that share their buffers on the graphics card, and are drawn by one call. */
class PageBuffer {
  private readonly vertices: BlockList;
  private readonly indices: BlockList;
  private readonly array: WebGLVertexArrayObject | null;
  private readonly places: WebGLBuffer | null;
  private readonly tints: WebGLBuffer | null;
  private readonly triangles: WebGLBuffer | null;
  private readonly pages: WebGLTexture | null;
  private readonly texels: Float32Array<ArrayBuffer>;  // of that texture
  private staleTexels: { begin: number; end: number } | null = null;  // blocks whose texels it does not have yet
  private counts = new Int32Array(64);
  private offsets = new Int32Array(64);
  private queued = 0;

  constructor(private readonly gl: WebGL2RenderingContext, vertexBlocks: number, indexBlocks: number) {
    this.vertices = new BlockList(vertexBlocks);
    this.indices = new BlockList(indexBlocks);
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    const make = (target: number, bytes: number): WebGLBuffer | null => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(target, buffer);
      gl.bufferData(target, bytes, gl.DYNAMIC_DRAW);
      return buffer;
    };
    this.places = make(gl.ARRAY_BUFFER, 8 * BLOCK_VERTICES * vertexBlocks);
    gl.enableVertexAttribArray(POSITION);
    gl.vertexAttribIPointer(POSITION, 4, gl.SHORT, 8, 0);
    this.tints = make(gl.ARRAY_BUFFER, 4 * BLOCK_VERTICES * vertexBlocks);
    gl.enableVertexAttribArray(TINT);
    gl.vertexAttribPointer(TINT, 4, gl.UNSIGNED_BYTE, true, 4, 0);
    this.triangles = make(gl.ELEMENT_ARRAY_BUFFER, 4 * BLOCK_INDICES * indexBlocks);
    gl.bindVertexArray(null);
    // Two texels a block of vertices: origin and quantum of its page, m; whether it has colours, and when it changed.
    this.pages = gl.createTexture();
    this.texels = new Float32Array(BLOCK_TEXELS * vertexBlocks);
    this.bindPages();
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, 2, vertexBlocks);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  }

  /** Copies a page into blocks that are free; null where too few are. */
  add(page: MeshPage, changedAtS: number): Placed | null {
    const vertices = this.vertices.take(blocksOf(page.positions.length / 4, BLOCK_VERTICES));
    if (!vertices) return null;
    const indices = this.indices.take(blocksOf(page.indices.length, BLOCK_INDICES));
    if (!indices) {
      this.vertices.give(vertices);
      return null;
    }
    const { gl } = this, { origin, quantum, hasColors } = page;
    const starts = vertices.flatMap(({ first, count }) => Array.from({ length: count }, (_, i) => (first + i) * BLOCK_VERTICES));
    this.copy(gl.ARRAY_BUFFER, this.places, 8 * BLOCK_VERTICES, page.positions, 4 * BLOCK_VERTICES, vertices);
    this.copy(gl.ARRAY_BUFFER, this.tints, 4 * BLOCK_VERTICES, page.tints, 4 * BLOCK_VERTICES, vertices);
    gl.bindVertexArray(this.array);
    this.copy(gl.ELEMENT_ARRAY_BUFFER, this.triangles, 4 * BLOCK_INDICES, moved(page.indices, starts), BLOCK_INDICES, indices);
    gl.bindVertexArray(null);
    for (const run of vertices) this.describe(run, [...origin, quantum, hasColors ? 1 : 0, changedAtS, 0, 0]);
    return { buffer: this, vertices, indices, indexCount: page.indices.length };
  }

  /** Frees a page's blocks; the graphics card's memory too where it was the last one, and then returns true. */
  remove({ vertices, indices }: Placed): boolean {
    this.vertices.give(vertices);
    this.indices.give(indices);
    if (!this.vertices.isEmpty) return false;
    this.gl.deleteVertexArray(this.array);
    for (const buffer of [this.places, this.tints, this.triangles]) this.gl.deleteBuffer(buffer);
    this.gl.deleteTexture(this.pages);
    return true;
  }

  /** Notes a page to be drawn by the next draw(). */
  queue({ indices, indexCount }: Placed): void {
    for (const { first, count } of indices) {
      if (this.queued === this.counts.length) {
        this.counts = grown(this.counts);
        this.offsets = grown(this.offsets);
      }
      this.counts[this.queued] = Math.min(count * BLOCK_INDICES, indexCount);
      this.offsets[this.queued] = 4 * BLOCK_INDICES * first;
      indexCount -= this.counts[this.queued++];
    }
  }

  /** Draws what was noted: by one call where the browser has it, else by one a page. */
  draw(many: WEBGL_multi_draw | null): void {
    if (this.queued === 0) return;
    const { gl, counts, offsets, queued } = this;
    gl.bindVertexArray(this.array);
    this.bindPages();
    this.copyTexels();
    if (many) many.multiDrawElementsWEBGL(gl.TRIANGLES, counts, 0, gl.UNSIGNED_INT, offsets, 0, queued);
    else for (let i = 0; i < queued; ++i) gl.drawElements(gl.TRIANGLES, counts[i], gl.UNSIGNED_INT, offsets[i]);
    this.queued = 0;
  }

  private bindPages(): void {
    this.gl.activeTexture(this.gl.TEXTURE0 + PAGES_UNIT);
    this.gl.bindTexture(this.gl.TEXTURE_2D, this.pages);
  }

  /** Notes the texels of blocks. The next picture copies them: one copy of all takes as long as one of a single block. */
  private describe({ first, count }: Run, texels: readonly number[]): void {
    for (let block = first; block < first + count; ++block) this.texels.set(texels, BLOCK_TEXELS * block);
    const { begin, end } = this.staleTexels ?? { begin: first, end: first };
    this.staleTexels = { begin: Math.min(begin, first), end: Math.max(end, first + count) };
  }

  private copyTexels(): void {
    if (!this.staleTexels) return;
    const { gl } = this, { begin, end } = this.staleTexels;
    gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, false);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, begin, 2, end - begin, gl.RGBA, gl.FLOAT, this.texels, BLOCK_TEXELS * begin);
    this.staleTexels = null;
  }

  /** Copies an array block by block, `perBlock` of its values a block of so many bytes. */
  private copy(target: number, buffer: WebGLBuffer | null, blockBytes: number, values: Int16Array | Uint8Array | Uint32Array, perBlock: number, runs: readonly Run[]): void {
    this.gl.bindBuffer(target, buffer);
    let from = 0;
    for (const { first, count } of runs) {
      const length = Math.min(count * perBlock, values.length - from);
      if (length > 0) this.gl.bufferSubData(target, first * blockBytes, values as ArrayBufferView<ArrayBuffer>, from, length);
      from += length;
    }
  }
}

/** Indices of a page's vertices -> of those of the buffer, where each block of them starts; valid until the next call. */
function moved(indices: Uint16Array | Uint32Array, starts: readonly number[]): Uint32Array {
  if (indices.length > movedIndices.length) movedIndices = new Uint32Array(2 * indices.length);
  // By a loop: from() with a function takes sixteen times as long.
  for (let i = 0; i < indices.length; ++i) movedIndices[i] = starts[Math.floor(indices[i] / BLOCK_VERTICES)] + indices[i] % BLOCK_VERTICES;
  return movedIndices.subarray(0, indices.length);
}
let movedIndices = new Uint32Array(0);

function grown(values: Int32Array<ArrayBuffer>): Int32Array<ArrayBuffer> {
  const result = new Int32Array(2 * values.length);
  result.set(values);
  return result;
}

/**
 * All pages on the graphics card, in few buffers: a picture of a thousand pages takes a call a buffer, where a call or more
 * a page takes most of the time of its script. Changes bindings of vertex arrays, buffers and textures.
 */
export class PageBuffers {
  private readonly many: WEBGL_multi_draw | null;
  private readonly buffers = new Set<PageBuffer>();

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.many = gl.getExtension("WEBGL_multi_draw");
  }

  /** `changedAtS`: when the page changed, in the seconds of the shader's `now`. */
  add(page: MeshPage, changedAtS: number): Placed {
    for (const buffer of this.buffers) {
      const placed = buffer.add(page, changedAtS);
      if (placed) return placed;
    }
    const vertexBlocks = Math.max(blocksOf(page.positions.length / 4, BLOCK_VERTICES), BUFFER_BLOCKS);
    const buffer = new PageBuffer(this.gl, vertexBlocks, Math.max(blocksOf(page.indices.length, BLOCK_INDICES), BUFFER_BLOCKS));
    this.buffers.add(buffer);
    return buffer.add(page, changedAtS)!;
  }

  remove(placed: Placed): void {
    if (placed.buffer.remove(placed)) this.buffers.delete(placed.buffer);
  }

  /** Draws the pages that were noted by their buffers' queue(). */
  draw(): void {
    for (const buffer of this.buffers) buffer.draw(this.many);
  }
}
