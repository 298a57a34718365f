import type { PageKey, Vec3 } from "../protocol/frames.ts";
import type { MeshPage } from "../protocol/mesh_page.ts";
import type { Box } from "./camera_rig.ts";
import { ageShare, COLOR_MODES, GREY, MAP_VALUES, MeshShader, POSITION, TINT, type ColorMode } from "./mesh_shader.ts";

interface Shown { page: MeshPage; center: Vec3; radiusM: number; changedAtS: number; array: WebGLVertexArrayObject | null; buffers: (WebGLBuffer | null)[]; indexType: number }

const nowS = (): number => performance.now() / 1000;
const WORST_ERROR_HALF_MM = 40;

/**
 * The model, page by page, drawn with plain WebGL: a thousand pages and more a picture, with three calls each, where a scene
 * graph's work on each object would take most of the time of a picture.
 */
export class MeshLayer {
  visible = true;
  bothSides = false;
  clipHeightM = Infinity;
  heights: [number, number] = [0, 3];
  mode: ColorMode = "colour";
  drawnPages = 0;
  private readonly shown = new Map<string, Shown>();
  private shader: MeshShader;
  private triangles = 0;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.shader = new MeshShader(gl);
    gl.canvas.addEventListener("webglcontextrestored", () => this.restore());
  }

  get triangleCount(): number { return this.triangles; }
  get pageCount(): number { return this.shown.size; }
  *pages(): Iterable<MeshPage> {
    for (const { page } of this.shown.values()) yield page;
  }

  set(page: MeshPage): void {
    this.remove(page.key);
    const center = [0, 1, 2].map(k => (page.low[k] + page.high[k]) / 2) as Vec3;
    const shown: Shown = {
      page, center, radiusM: Math.hypot(...page.high.map((value, k) => value - center[k])), changedAtS: nowS() - page.ageS,
      array: null, buffers: [], indexType: page.indices instanceof Uint16Array ? this.gl.UNSIGNED_SHORT : this.gl.UNSIGNED_INT,
    };
    this.upload(shown);
    this.shown.set(page.key.join(), shown);
    this.triangles += page.indices.length / 3;
  }

  remove(key: PageKey): void {
    const old = this.shown.get(key.join());
    if (!old) return;
    this.triangles -= old.page.indices.length / 3;
    this.gl.deleteVertexArray(old.array);
    old.buffers.forEach(buffer => this.gl.deleteBuffer(buffer));
    this.shown.delete(key.join());
  }

  clear(): void {
    for (const { page } of [...this.shown.values()]) this.remove(page.key);
  }

  /** Box of all vertices, or null. */
  box(): Box | null {
    const low: Vec3 = [Infinity, Infinity, Infinity], high: Vec3 = [-Infinity, -Infinity, -Infinity];
    for (const { page } of this.shown.values())
      for (let k = 0; k < 3; ++k) {
        low[k] = Math.min(low[k], page.low[k]);
        high[k] = Math.max(high[k], page.high[k]);
      }
    return this.shown.size ? { low, high } : null;
  }

  /** Draws what is in view; `toClip`: from metres to clip space, by columns. Leaves WebGL in another state than it was. */
  draw(toClip: ArrayLike<number>, eye: Vec3): void {
    this.drawnPages = 0;
    if (!this.visible || this.shown.size === 0) return;
    this.begin(toClip, eye);
    const { gl, shader } = this, planes = frustumPlanes(toClip), page = shader.at("page"), mode = shader.at("mode"), age = shader.at("age");
    const number = COLOR_MODES.indexOf(this.mode), now = nowS();
    let lastMode = -1;
    for (const shown of this.shown.values()) {
      if (!inView(planes, shown.center, shown.radiusM)) continue;
      const { origin, quantum, hasColors, indices } = shown.page, wanted = hasColors || number > 0 ? number : GREY;
      if (wanted !== lastMode) gl.uniform1i(mode, lastMode = wanted);
      if (this.mode === "age") gl.uniform1f(age, ageShare(now - shown.changedAtS));
      gl.bindVertexArray(shown.array);
      gl.uniform4f(page, origin[0], origin[1], origin[2], quantum);
      gl.drawElements(gl.TRIANGLES, indices.length, shown.indexType, 0);
      ++this.drawnPages;
    }
    gl.bindVertexArray(null);
  }

  private begin(toClip: ArrayLike<number>, eye: Vec3): void {
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

  private upload(shown: Shown): void {
    const { gl } = this, { positions, tints, indices } = shown.page;
    shown.array = gl.createVertexArray();
    gl.bindVertexArray(shown.array);
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
    shown.buffers = [places, colors, fill(gl.ELEMENT_ARRAY_BUFFER, indices as BufferSource)];
    gl.bindVertexArray(null);
  }

  /** The graphics card forgot everything; the pages are still here. */
  private restore(): void {
    this.shader = new MeshShader(this.gl);
    for (const shown of this.shown.values()) this.upload(shown);
  }
}

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
