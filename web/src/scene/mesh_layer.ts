import type { PageKey, Vec3 } from "../protocol/frames.ts";
import { voxelOf, type MeshPage } from "../protocol/mesh_page.ts";
import type { Box } from "./camera_rig.ts";
import { chooseLevel, triangleSide } from "./level_choice.ts";
import { ageShare, COLOR_MODES, GREY, MAP_VALUES, MeshShader, POSITION, TINT, type ColorMode } from "./mesh_shader.ts";

/** A level of a page, as it is drawn. */
interface Level { page: MeshPage; array: WebGLVertexArrayObject | null; buffers: (WebGLBuffer | null)[]; indexType: number }
/** The levels of a page's newest version that have come, each at its number. `drawn` is that of the last picture. */
interface Shown { levels: (Level | undefined)[]; sidesM: (number | undefined)[]; finest: number; drawn: number; center: Vec3; radiusM: number; changedAtS: number }

/** What a picture is drawn from: from metres to clip space, by columns; the eye; metres that a pixel covers at a distance from it. */
export interface Look { toClip: ArrayLike<number>; eye: Vec3; pixelAt(distanceM: number): number }

const nowS = (): number => performance.now() / 1000;
const WORST_ERROR_HALF_MM = 40;
/** Levels are chosen again when the eye has moved by this share of its distance to the nearest page, or by so much at least. */
const MOVED_SHARE = 0.1, MOVED_M = 0.05;

const distanceOf = (a: Vec3, b: Vec3): number => Math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2);  // hypot is slow

/**
 * The model, page by page, drawn with plain WebGL: a thousand pages and more a picture, with three calls each, where a scene
 * graph's work on each object would take most of the time of a picture. What is far is drawn in coarser levels.
 */
export class MeshLayer {
  visible = true;
  bothSides = false;
  clipHeightM = Infinity;
  heights: [number, number] = [0, 3];
  mode: ColorMode = "colour";
  /** Edge of a voxel of the map that the model comes from, m, by its pages; 0 without any. */
  voxelM = 0;
  /** Every page in its finest level. */
  finestOnly = false;
  drawnPages = 0;
  drawnTriangles = 0;
  private readonly shown = new Map<string, Shown>();
  private shader: MeshShader;
  private triangles = 0;
  /** Where the levels were chosen from; null: they have to be chosen again. */
  private chosen: { eye: Vec3; pixelM: number; reachM: number } | null = null;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.shader = new MeshShader(gl);
    gl.canvas.addEventListener("webglcontextrestored", () => this.restore());
  }

  /** Of the finest levels. */
  get triangleCount(): number { return this.triangles; }
  get pageCount(): number { return this.shown.size; }
  /** Whether some level of this version of the page is there. */
  has({ key, version }: MeshPage): boolean {
    const shown = this.shown.get(key.join());
    return shown !== undefined && finestOf(shown).version === version;
  }
  /** The finest level of each page. */
  *pages(): Iterable<MeshPage> {
    for (const shown of this.shown.values()) yield finestOf(shown);
  }

  /** Adds a level, or replaces the page where it is of another version. */
  set(page: MeshPage): void {
    const name = page.key.join();
    if (this.voxelM === 0 || voxelOf(page) < this.voxelM) this.voxelM = voxelOf(page);
    let shown = this.shown.get(name);
    if (shown && finestOf(shown).version !== page.version) {
      this.remove(page.key);
      shown = undefined;
    }
    shown ??= { levels: [], sidesM: [], finest: Infinity, drawn: page.level, center: [0, 0, 0], radiusM: 0, changedAtS: nowS() - page.ageS };
    this.drop(shown, page.level);
    shown.levels[page.level] = this.upload(page);
    shown.sidesM[page.level] = triangleSide(page);
    if (page.level <= shown.finest) {
      this.triangles += (page.indices.length - (shown.levels[shown.finest]?.page.indices.length ?? 0)) / 3;
      const center = [0, 1, 2].map(k => (page.low[k] + page.high[k]) / 2) as Vec3;
      Object.assign(shown, { finest: page.level, center, radiusM: distanceOf(page.high, center) });
    }
    this.shown.set(name, shown);
    this.chosen = null;
  }

  remove(key: PageKey): void {
    const old = this.shown.get(key.join());
    if (!old) return;
    this.triangles -= finestOf(old).indices.length / 3;
    old.levels.forEach((_, level) => this.drop(old, level));
    this.shown.delete(key.join());
  }

  clear(): void {
    for (const page of [...this.pages()]) this.remove(page.key);
    this.voxelM = 0;
  }

  /** Box of all vertices, or null. */
  box(): Box | null {
    const low: Vec3 = [Infinity, Infinity, Infinity], high: Vec3 = [-Infinity, -Infinity, -Infinity];
    for (const page of this.pages())
      for (let k = 0; k < 3; ++k) {
        low[k] = Math.min(low[k], page.low[k]);
        high[k] = Math.max(high[k], page.high[k]);
      }
    return this.shown.size ? { low, high } : null;
  }

  /** Draws what is in view. Leaves WebGL in another state than it was. */
  draw(look: Look): void {
    this.drawnPages = this.drawnTriangles = 0;
    if (!this.visible || this.shown.size === 0) return;
    this.choose(look);
    this.begin(look);
    const { gl, shader } = this, planes = frustumPlanes(look.toClip), place = shader.at("page"), mode = shader.at("mode"), age = shader.at("age");
    const number = COLOR_MODES.indexOf(this.mode), now = nowS();
    let lastMode = -1;
    for (const shown of this.shown.values()) {
      if (!inView(planes, shown.center, shown.radiusM)) continue;
      const { page, array, indexType } = shown.levels[this.finestOnly ? shown.finest : shown.drawn]!;
      const { origin, quantum, hasColors, indices } = page, wanted = hasColors || number > 0 ? number : GREY;
      if (wanted !== lastMode) gl.uniform1i(mode, wanted);
      lastMode = wanted;
      if (this.mode === "age") gl.uniform1f(age, ageShare(now - shown.changedAtS));
      gl.bindVertexArray(array);
      gl.uniform4f(place, origin[0], origin[1], origin[2], quantum);
      gl.drawElements(gl.TRIANGLES, indices.length, indexType, 0);
      ++this.drawnPages;
      this.drawnTriangles += indices.length / 3;
    }
    gl.bindVertexArray(null);
  }

  /** Chooses the level of each page by how large its triangles are from here, where it was not done from about here. */
  private choose({ eye, pixelAt }: Look): void {
    const pixelM = pixelAt(1), old = this.chosen;
    if (old && old.pixelM === pixelM && distanceOf(old.eye, eye) <= old.reachM) return;
    let nearestM = Infinity;
    for (const shown of this.shown.values()) {
      const distanceM = Math.max(distanceOf(shown.center, eye) - shown.radiusM, 0);
      shown.drawn = chooseLevel(shown.sidesM, pixelAt(distanceM), shown.drawn);
      nearestM = Math.min(nearestM, distanceM);
    }
    this.chosen = { eye, pixelM, reachM: Math.max(MOVED_SHARE * nearestM, MOVED_M) };
  }

  private begin({ toClip, eye }: Look): void {
    const { gl, shader } = this;
    gl.useProgram(shader.program);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    if (this.bothSides) gl.disable(gl.CULL_FACE);
    else gl.enable(gl.CULL_FACE);
    gl.cullFace(gl.BACK);
    gl.frontFace(gl.CCW);
    gl.uniformMatrix4fv(shader.at("toClip"), false, Float32Array.from(toClip));
    gl.uniform3f(shader.at("eye"), ...eye);
    gl.uniform1f(shader.at("clipHeight"), Math.min(this.clipHeightM, 1e9));
    gl.uniform1f(shader.at("worstError"), WORST_ERROR_HALF_MM);
    gl.uniform2f(shader.at("heights"), ...this.heights);
    gl.uniform3fv(shader.at("map"), MAP_VALUES);
  }

  private upload(page: MeshPage): Level {
    const { gl } = this, { positions, tints, indices } = page, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const fill = (target: number, values: BufferSource): WebGLBuffer | null => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(target, buffer);
      gl.bufferData(target, values, gl.STATIC_DRAW);
      return buffer;
    };
    const places = fill(gl.ARRAY_BUFFER, positions as BufferSource);
    gl.enableVertexAttribArray(POSITION);
    gl.vertexAttribIPointer(POSITION, 4, gl.SHORT, 8, 0);
    const colors = fill(gl.ARRAY_BUFFER, tints as BufferSource);
    gl.enableVertexAttribArray(TINT);
    gl.vertexAttribPointer(TINT, 4, gl.UNSIGNED_BYTE, true, 4, 0);
    const buffers = [places, colors, fill(gl.ELEMENT_ARRAY_BUFFER, indices as BufferSource)];
    gl.bindVertexArray(null);
    return { page, array, buffers, indexType: indices instanceof Uint16Array ? gl.UNSIGNED_SHORT : gl.UNSIGNED_INT };
  }

  private drop({ levels }: Shown, number: number): void {
    this.gl.deleteVertexArray(levels[number]?.array ?? null);
    levels[number]?.buffers.forEach(buffer => this.gl.deleteBuffer(buffer));
  }

  /** The graphics card forgot everything; the pages are still here. */
  private restore(): void {
    this.shader = new MeshShader(this.gl);
    for (const { levels } of this.shown.values()) levels.forEach((level, number) => { if (level) levels[number] = this.upload(level.page); });
  }
}

const finestOf = ({ levels, finest }: Shown): MeshPage => levels[finest]!.page;

/** The six planes of the view, each a, b, c, d with a unit normal: a point inside has a x + b y + c z + d >= 0. */
export function frustumPlanes(toClip: ArrayLike<number>): number[][] {
  const row = (i: number): number[] => [0, 1, 2, 3].map(column => toClip[4 * column + i]);
  const last = row(3);
  return [0, 1, 2].flatMap(i => [1, -1].map(sign => {
    const plane = row(i).map((value, k) => last[k] + sign * value), size = Math.hypot(plane[0], plane[1], plane[2]);
    return plane.map(value => value / size);
  }));
}

export function inView(planes: number[][], [x, y, z]: Vec3, radius: number): boolean {
  for (const plane of planes) if (plane[0] * x + plane[1] * y + plane[2] * z + plane[3] < -radius) return false;
  return true;
}
