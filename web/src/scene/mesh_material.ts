import { DoubleSide, FrontSide, GLSL3, RawShaderMaterial, Vector3, type IUniform } from "three";

export const COLOR_MODES = ["colour", "normals", "height", "age", "error"] as const;
export type ColorMode = (typeof COLOR_MODES)[number];

/** Viridis, read at nine places: even in lightness, the same for the colour-blind. */
export const COLOR_MAP = ["440154", "472d7b", "3b528b", "2c728e", "21918c", "28ae80", "5ec962", "addc30", "fde725"];
const mapVectors = COLOR_MAP.map(hex => new Vector3(...[0, 2, 4].map(i => parseInt(hex.slice(i, i + 2), 16) / 255)));

/** Ages in seconds at which the colour of the mode "age" changes. */
export const AGE_LIMITS_S = [1, 3, 10, 30, 60, 180, 600, 1800];

const VERTEX = `
precision highp float;
precision highp int;
uniform mat4 modelMatrix, viewMatrix, projectionMatrix;
in ivec4 position;  // quanta from the origin of the page; octahedral normal
in vec4 tint;       // colour; error
out vec3 world, normal, color;
out float error;
void main() {
  vec4 place = modelMatrix * vec4(vec3(position.xyz), 1.0);
  world = place.xyz;
  vec2 uv = vec2((position.w << 24) >> 24, (position.w << 16) >> 24) / 127.0;
  normal = vec3(uv, 1.0 - abs(uv.x) - abs(uv.y));
  float fold = max(-normal.z, 0.0);
  normal.x += normal.x >= 0.0 ? -fold : fold;
  normal.y += normal.y >= 0.0 ? -fold : fold;
  color = tint.rgb;
  error = tint.a * 255.0;
  gl_Position = projectionMatrix * viewMatrix * place;
}`;

const FRAGMENT = `
precision highp float;
uniform int mode;
uniform float clipHeight, age, worstError;
uniform vec2 heights;
uniform vec3 eye, map[9];
in vec3 world, normal, color;
in float error;
out vec4 result;
vec3 mapped(float share) {
  float at = clamp(share, 0.0, 1.0) * 8.0;
  int low = min(int(at), 7);
  return mix(map[low], map[low + 1], at - float(low));
}
void main() {
  if (world.z > clipHeight) discard;
  vec3 n = normalize(normal), toEye = normalize(eye - world);
  float facing = dot(n, toEye);
  vec3 base = color;
  if (mode == 1) base = 0.5 + 0.5 * n;
  else if (mode == 2) base = mapped((world.z - heights.x) / max(heights.y - heights.x, 0.1));
  else if (mode == 3) base = mapped(1.0 - age);
  else if (mode == 4) base = error > 254.5 ? vec3(0.55) : mapped(error / worstError);
  else if (mode == 5) base = vec3(0.78, 0.77, 0.74);
  float light = 0.62 + 0.28 * max(facing, 0.0) + 0.10 * n.z;
  if (mode == 1) light = 1.0;
  if (mode == 0) light = 0.86 + 0.14 * max(facing, 0.0);
  if (!gl_FrontFacing) { base = mix(base, vec3(0.45, 0.45, 0.5), 0.6); light *= 0.75; }
  result = vec4(base * light, 1.0);
}`;

/** The one shader of the mesh, in as many materials as ages are told apart; all share the uniforms but `age`. */
export class MeshMaterials {
  private readonly shared: Record<string, IUniform> = {
    clipHeight: { value: 1e9 }, worstError: { value: 40 }, heights: { value: [0, 3] }, eye: { value: new Vector3() },
    map: { value: mapVectors },
  };
  private readonly mode = { value: 0 };
  private readonly grey = { value: 5 };  // of pages without colours
  private readonly byAge: RawShaderMaterial[];
  private readonly withoutColors: RawShaderMaterial;

  constructor() {
    this.byAge = Array.from({ length: AGE_LIMITS_S.length + 1 }, (_, i) => this.make(this.mode, i / AGE_LIMITS_S.length));
    this.withoutColors = this.make(this.grey, 0);
  }

  setMode(mode: ColorMode): void {
    this.mode.value = COLOR_MODES.indexOf(mode);
    this.grey.value = mode === "colour" ? 5 : this.mode.value;
  }
  setClipHeight(height: number): void { this.shared.clipHeight.value = height; }
  setHeights(low: number, high: number): void { this.shared.heights.value = [low, high]; }
  setEye(x: number, y: number, z: number): void { this.shared.eye.value.set(x, y, z); }
  setBothSides(both: boolean): void {
    for (const material of [...this.byAge, this.withoutColors]) material.side = both ? DoubleSide : FrontSide;
  }

  /** The material of a page that changed `ageS` seconds ago; the age counts in the mode "age" only. */
  of(hasColors: boolean, ageS: number): RawShaderMaterial {
    if (this.mode.value === COLOR_MODES.indexOf("age")) {
      const index = AGE_LIMITS_S.findIndex(limit => ageS < limit);
      return this.byAge[index < 0 ? AGE_LIMITS_S.length : index];
    }
    return hasColors ? this.byAge[0] : this.withoutColors;
  }

  private make(mode: IUniform, age: number): RawShaderMaterial {
    return new RawShaderMaterial({
      glslVersion: GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT,
      uniforms: { ...this.shared, mode, age: { value: age } },
    });
  }
}
