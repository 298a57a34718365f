import { Color, DynamicDrawUsage, GLSL3, InstancedBufferGeometry, InstancedInterleavedBuffer, BufferAttribute,
         InterleavedBufferAttribute, Mesh, RawShaderMaterial, Vector2 } from "three";

const VERTEX = `
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform vec2 viewSize;
uniform float width, clipHeight;
in vec3 position;  // which end; which side
in vec3 begin, end;
void main() {
  vec4 a = modelViewMatrix * vec4(begin, 1.0), b = modelViewMatrix * vec4(end, 1.0);
  // What lies behind the camera is cut off, or it would be mirrored.
  bool perspective = projectionMatrix[3][3] == 0.0;
  if (min(begin.z, end.z) > clipHeight) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
  if (perspective) {
    float near = -0.02;
    if (a.z > near && b.z > near) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
    if (a.z > near) a = mix(b, a, (near - b.z) / (a.z - b.z));
    if (b.z > near) b = mix(a, b, (near - a.z) / (b.z - a.z));
  }
  vec4 from = projectionMatrix * a, to = projectionMatrix * b;
  vec2 pa = from.xy / from.w * viewSize, pb = to.xy / to.w * viewSize, way = pb - pa;
  float size = length(way);
  way = size > 1e-4 ? way / size : vec2(1.0, 0.0);
  vec4 place = position.x < 0.5 ? from : to;
  vec2 offset = vec2(-way.y, way.x) * position.y + way * (position.x * 2.0 - 1.0) * 0.5;
  place.xy += offset * width / viewSize * place.w;
  gl_Position = place;
}`;

const FRAGMENT = `
precision highp float;
uniform vec3 color;
uniform float opacity;
out vec4 result;
void main() { result = vec4(color, opacity); }`;

/** Size of the view in pixels of the screen, shared by all lines. */
export const viewSize = { value: new Vector2(1, 1) };

export interface LineStyle { color: string; widthPx: number; opacity?: number; onTop?: boolean }

/** Segments of a constant width in pixels. */
export class Lines extends Mesh<InstancedBufferGeometry, RawShaderMaterial> {
  private capacity = 0;
  private points = new Float32Array(0);

  constructor(style: LineStyle) {
    const geometry = new InstancedBufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(new Float32Array([0, -1, 0, 0, 1, 0, 1, -1, 0, 1, 1, 0]), 3));
    geometry.setIndex([0, 2, 1, 1, 2, 3]);
    geometry.instanceCount = 0;
    const opacity = style.opacity ?? 1;
    super(geometry, new RawShaderMaterial({
      glslVersion: GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT, side: 2,
      transparent: opacity < 1 || style.onTop,  // drawn after all that is transparent
      depthTest: !style.onTop, depthWrite: !style.onTop,
      uniforms: { viewSize, width: { value: style.widthPx * devicePixelRatio }, color: { value: new Color(style.color).convertLinearToSRGB() }, opacity: { value: opacity }, clipHeight: { value: 1e9 } },
    }));
    this.frustumCulled = false;
    if (style.onTop) this.renderOrder = 10;
  }

  /** Segments that lie above are not drawn. */
  setClipHeight(heightM: number): void { this.material.uniforms.clipHeight.value = Math.min(heightM, 1e9); }

  /** Six numbers a segment. */
  setSegments(points: Float32Array): void {
    if (points.length > this.capacity) {
      this.capacity = Math.max(2 * this.capacity, points.length, 60);
      this.points = new Float32Array(this.capacity);
      const buffer = new InstancedInterleavedBuffer(this.points, 6).setUsage(DynamicDrawUsage);
      this.geometry.dispose();
      this.geometry.setAttribute("begin", new InterleavedBufferAttribute(buffer, 3, 0));
      this.geometry.setAttribute("end", new InterleavedBufferAttribute(buffer, 3, 3));
    }
    this.points.set(points);
    this.geometry.instanceCount = points.length / 6;
    const begin = this.geometry.getAttribute("begin") as InterleavedBufferAttribute | undefined;
    if (begin) begin.data.needsUpdate = true;
  }

  /** Three numbers a point of one line. */
  setLine(points: ArrayLike<number>): void {
    const count = Math.max(points.length / 3 - 1, 0), segments = new Float32Array(6 * count);
    for (let i = 0; i < count; ++i) for (let k = 0; k < 6; ++k) segments[6 * i + k] = points[3 * i + k];
    this.setSegments(segments);
  }
}
