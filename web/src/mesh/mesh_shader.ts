export const COLOR_MODES = ["colour", "normals", "height", "age", "error"] as const;
export type ColorMode = (typeof COLOR_MODES)[number];

/** Viridis, read at nine places: even in lightness, the same for the colour-blind. */
export const COLOR_MAP = ["440154", "472d7b", "3b528b", "2c728e", "21918c", "28ae80", "5ec962", "addc30", "fde725"];
export const MAP_VALUES = COLOR_MAP.flatMap(hex => [0, 2, 4].map(i => parseInt(hex.slice(i, i + 2), 16) / 255));

/** Ages in seconds at which the colour of the mode "age" changes. */
const AGE_LIMITS_S = [1, 3, 10, 30, 60, 180, 600, 1800];
export const OLDEST_S = AGE_LIMITS_S[AGE_LIMITS_S.length - 1];

/** Places of the attributes; the unit of the texture of pages. */
export const POSITION = 0, TINT = 1, PAGES_UNIT = 0;
/** A block of so many vertices belongs to one page: the shader finds the page by the number of a vertex. Coarse levels of a page have about a hundred. */
export const BLOCK_VERTICES = 128;

const VERTEX = `
precision highp float;
precision highp int;
precision highp sampler2D;
uniform mat4 toClip;
uniform sampler2D pages;  // two texels a block of vertices: origin, m, and quantum, m; whether it has colours, when it changed, s
uniform float now;        // s
in ivec4 position;  // quanta from the origin of the page; octahedral normal
in vec4 tint;       // colour; error
out vec3 world, normal, color;
out float error;
flat out float age;  // 0 for what changed just now, 1 for what is old
flat out int hasColors;
void main() {
  int block = gl_VertexID / ${BLOCK_VERTICES};
  vec4 page = texelFetch(pages, ivec2(0, block), 0), state = texelFetch(pages, ivec2(1, block), 0);
  hasColors = int(state.x);
  age = 0.0;
  float limits[${AGE_LIMITS_S.length}] = float[](${AGE_LIMITS_S.map(limit => limit.toFixed(1)).join(", ")});
  for (int i = 0; i < ${AGE_LIMITS_S.length}; ++i) if (now - state.y >= limits[i]) age += ${(1 / AGE_LIMITS_S.length).toFixed(6)};
  world = page.xyz + page.w * vec3(position.xyz);
  vec2 uv = vec2((position.w << 24) >> 24, (position.w << 16) >> 24) / 127.0;
  normal = vec3(uv, 1.0 - abs(uv.x) - abs(uv.y));
  float fold = max(-normal.z, 0.0);
  normal.x += normal.x >= 0.0 ? -fold : fold;
  normal.y += normal.y >= 0.0 ? -fold : fold;
  color = tint.rgb;
  error = tint.a * 255.0;
  gl_Position = toClip * vec4(world, 1.0);
}`;

const FRAGMENT = `
precision highp float;
uniform int mode;
uniform float clipHeight, worstError;
uniform vec2 heights;
uniform vec3 eye, map[9];
in vec3 world, normal, color;
in float error;
flat in float age;
flat in int hasColors;
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
  vec3 base = hasColors == 1 ? color : vec3(0.78, 0.77, 0.74);
  if (mode == 1) base = 0.5 + 0.5 * n;
  else if (mode == 2) base = mapped((world.z - heights.x) / max(heights.y - heights.x, 0.1));
  else if (mode == 3) base = mapped(1.0 - age);
  else if (mode == 4) base = error > 254.5 ? vec3(0.55) : mapped(error / worstError);
  float light = 0.62 + 0.28 * max(facing, 0.0) + 0.10 * n.z;
  if (mode == 1) light = 1.0;
  if (mode == 0 && hasColors == 1) light = 0.86 + 0.14 * max(facing, 0.0);
  if (!gl_FrontFacing) { base = mix(base, vec3(0.45, 0.45, 0.5), 0.6); light *= 0.75; }
  result = vec4(base * light, 1.0);
}`;

/** The one shader of the mesh, made with plain WebGL; throws where it does not compile. */
export class MeshShader {
  readonly program: WebGLProgram;
  private readonly places = new Map<string, WebGLUniformLocation | null>();

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]] as const) {
      const shader = gl.createShader(kind)!;
      gl.shaderSource(shader, `#version 300 es${text}`);
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
    }
    gl.bindAttribLocation(this.program, POSITION, "position");
    gl.bindAttribLocation(this.program, TINT, "tint");
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(this.program) ?? "the shader of the mesh");
  }

  /** Where a uniform is. */
  at(name: string): WebGLUniformLocation | null {
    if (!this.places.has(name)) this.places.set(name, this.gl.getUniformLocation(this.program, name));
    return this.places.get(name)!;
  }
}
