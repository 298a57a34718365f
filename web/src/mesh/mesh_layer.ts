import type { Box, PageKey, Vec3 } from "../protocol/frames.ts";
import { voxelOf, type MeshPage } from "../protocol/mesh_page.ts";
import { chooseLevel, triangleSide } from "./level_choice.ts";
import { COLOR_MODES, MAP_VALUES, MeshShader, PAGES_UNIT, type ColorMode } from "./mesh_shader.ts";
import { PageBuffers, type Placed } from "./page_buffers.ts";

/** A level of a page, as it is drawn. */
interface Level { page: MeshPage; placed: Placed }
/** The levels of a page's newest version that have come, each at its number. `drawn` is that of the last picture. */
interface Shown { levels: (Level | undefined)[]; sidesM: (number | undefined)[]; finest: number; drawn: number; center: Vec3; radiusM: number; changedAtS: number }

/** What a picture is drawn from: from metres to clip space, by columns; the eye; metres that a pixel covers at a distance from it. */
export interface Look { toClip: ArrayLike<number>; eye: Vec3; pixelAt(distanceM: number): number }

const nowS = (): number => performance.now() / 1000;
const WORST_ERROR_HALF_MM = 40;
/** Levels are chosen again when the eye has moved by this share of its distance to the nearest page, or by so much at least. */
const MOVED_SHARE = 0.1, MOVED_M = 0.05;

const distanceOf = (a: Vec3, b: Vec3): number => Math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2);  // hypot is slow

/** The model, page by page, drawn with plain WebGL from buffers that pages share. What is far is drawn in coarser levels. */
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
  private buffers: PageBuffers;
  private triangles = 0;
  /** Where the levels were chosen from; null: they have to be chosen again. */
  private chosen: { eye: Vec3; pixelM: number; reachM: number } | null = null;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.shader = new MeshShader(gl);
    this.buffers = new PageBuffers(gl);
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
    shown.levels[page.level] = { page, placed: this.buffers.add(page, shown.changedAtS) };
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
    const planes = frustumPlanes(look.toClip);
    for (const shown of this.shown.values()) {
      if (!inView(planes, shown.center, shown.radiusM)) continue;
      const { page, placed } = shown.levels[this.finestOnly ? shown.finest : shown.drawn]!;
      placed.buffer.queue(placed);
      ++this.drawnPages;
      this.drawnTriangles += page.indices.length / 3;
    }
    this.buffers.draw();
    this.gl.bindVertexArray(null);
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
    gl.uniform1i(shader.at("mode"), COLOR_MODES.indexOf(this.mode));
    gl.uniform1f(shader.at("now"), nowS());
    gl.uniform1i(shader.at("pages"), PAGES_UNIT);
    gl.uniform3fv(shader.at("map"), MAP_VALUES);
  }

  private drop({ levels }: Shown, number: number): void {
    const level = levels[number];
    if (level) this.buffers.remove(level.placed);
    levels[number] = undefined;
  }

  /** The graphics card forgot everything; the pages are still here. */
  private restore(): void {
    this.shader = new MeshShader(this.gl);
    this.buffers = new PageBuffers(this.gl);
    for (const { levels, changedAtS } of this.shown.values()) for (const level of levels) if (level) level.placed = this.buffers.add(level.page, changedAtS);
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
