import { BufferAttribute, BufferGeometry, Color, GLSL3, Points, RawShaderMaterial } from "three";

const VERTEX = `
precision highp float;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform float size;
in vec3 position;
void main() {
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  gl_PointSize = size;
}`;

const FRAGMENT = `
precision highp float;
uniform vec3 color;
out vec4 result;
void main() {
  float r = length(gl_PointCoord - 0.5);
  if (r > 0.5) discard;
  result = vec4(r > 0.36 ? color * 0.35 : color, 1.0);
}`;

/** Round points of a constant size in pixels. */
export class Dots extends Points<BufferGeometry, RawShaderMaterial> {
  constructor(color: string, sizePx: number, onTop = false) {
    super(new BufferGeometry(), new RawShaderMaterial({
      glslVersion: GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT, depthTest: !onTop, transparent: onTop,
      uniforms: { size: { value: sizePx * devicePixelRatio }, color: { value: new Color(color).convertLinearToSRGB() } },
    }));
    this.frustumCulled = false;
    this.visible = false;
    if (onTop) this.renderOrder = 11;
  }

  setPoints(points: Float32Array): void {
    this.geometry.dispose();
    this.geometry = new BufferGeometry();
    this.geometry.setAttribute("position", new BufferAttribute(points, 3));
    this.visible = points.length > 0;
  }
}
