// The model of a report in WebGL 2: orbit, pan, zoom, cut away what is above a height, choose what colours it.
// Reads what model_view.cpp wrote: <div class="model" hidden> with a canvas and the data as JSON. Without WebGL the
// view stays hidden and the page shows its figures. Lengths are metres, z is up.
"use strict";

// ---- the data ----

function bytesOf(base64) {
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

// Indices in the order of their first use: each is the number of vertices used so far minus it, as a varint.
function decodeIndices(bytes, count) {
  const indices = new Uint32Array(count);
  let next = 0;
  for (let i = 0, at = 0; i < count; ++i) {
    let distance = 0, shift = 0, byte;
    do {
      byte = bytes[at++];
      distance |= (byte & 127) << shift;
      shift += 7;
    } while (byte > 127);
    indices[i] = next - distance;
    if (distance === 0) ++next;
  }
  return indices;
}

// Steps of 1/65535 of the box, three a point.
function decodePoints(bytes, low, high) {
  const points = new Float32Array(bytes.length / 2);
  for (let i = 0; i < points.length; ++i) {
    const axis = i % 3;
    points[i] = low[axis] + (bytes[2 * i] + 256 * bytes[2 * i + 1]) / 65535 * (high[axis] - low[axis]);
  }
  return points;
}

// Unit normals of the vertices, weighted by area.
function normalsOf(points, indices) {
  const normals = new Float32Array(points.length);
  for (let t = 0; t < indices.length; t += 3) {
    const a = 3 * indices[t], b = 3 * indices[t + 1], c = 3 * indices[t + 2];
    const ux = points[b] - points[a], uy = points[b + 1] - points[a + 1], uz = points[b + 2] - points[a + 2];
    const vx = points[c] - points[a], vy = points[c + 1] - points[a + 1], vz = points[c + 2] - points[a + 2];
    const n = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    for (const vertex of [a, b, c])
      for (let k = 0; k < 3; ++k) normals[vertex + k] += n[k];
  }
  for (let i = 0; i < normals.length; i += 3) {
    const length = Math.hypot(normals[i], normals[i + 1], normals[i + 2]) || 1;
    for (let k = 0; k < 3; ++k) normals[i + k] /= length;
  }
  return normals;
}

function decodeModel(data) {
  const points = decodePoints(bytesOf(data.points), data.low, data.high);
  const indices = decodeIndices(bytesOf(data.indices), data.index_count);
  return {
    points, indices, normals: normalsOf(points, indices),
    colors: data.colors ? bytesOf(data.colors) : null,
    errors: data.errors ? bytesOf(data.errors) : null,  // 0..254 is -limit..limit, 255 is unknown
    path: decodePoints(bytesOf(data.path), data.low, data.high),
  };
}

// A colour for each vertex, 0..255. `map` of a value 0..1 is a row of colours "rrggbb".
function colorsOf(model, data, kind) {
  const count = model.points.length / 3, colors = new Uint8Array(3 * count);
  const tables = {};
  for (const name of ["height", "error"])
    tables[name] = data.maps[name].match(/.{6}/g).map(c => [0, 2, 4].map(k => parseInt(c.substr(k, 2), 16)));
  const fromTable = (table, value) => table[Math.round(Math.min(Math.max(value, 0), 1) * (table.length - 1))];
  const [bottom, top] = data.heights;
  for (let i = 0; i < count; ++i) {
    let color;
    if (kind === "colour") color = model.colors.subarray(3 * i, 3 * i + 3);
    else if (kind === "height") color = fromTable(tables.height, (model.points[3 * i + 2] - bottom) / (top - bottom));
    else if (kind === "normal") color = [0, 1, 2].map(k => 127.5 + 127.5 * model.normals[3 * i + k]);
    else if (kind === "error" && model.errors[i] < 255) color = fromTable(tables.error, model.errors[i] / 254);
    else color = kind === "error" ? [120, 120, 120] : [196, 200, 206];
    colors.set(color, 3 * i);
  }
  return colors;
}

// ---- the camera: a point that it looks at, a distance, two angles ----

class Camera {
  constructor(points) {
    this.points = points;  // what is to be seen at first
    this.reset(1.6);
  }
  axes() {
    const [sa, ca, se, ce] = [Math.sin(this.azimuth), Math.cos(this.azimuth), Math.sin(this.elevation),
                              Math.cos(this.elevation)];
    return {right: [ca, -sa, 0], up: [sa * se, ca * se, ce], ahead: [sa * ce, ca * ce, -se]};
  }
  // Three quarters from above, as near as all points can be seen: for both directions of the view, the two lines that
  // bound the points meet at the camera.
  reset(aspect) {
    this.azimuth = 0.5;
    this.elevation = 0.85;
    const {right, up, ahead} = this.axes(), dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let depth = Infinity;
    const [across, above] = [[right, 0.92 * Camera.slope * aspect], [up, 0.92 * Camera.slope]].map(([axis, slope]) => {
      const high = Math.max(...this.points.map(p => dot(p, axis) - slope * dot(p, ahead)));
      const low = Math.max(...this.points.map(p => -dot(p, axis) - slope * dot(p, ahead)));
      depth = Math.min(depth, -(high + low) / (2 * slope));
      return (high - low) / 2;
    });
    const depths = this.points.map(p => dot(p, ahead));
    this.distance = Math.max((Math.min(...depths) + Math.max(...depths)) / 2 - depth, 0.05);
    this.target = [0, 1, 2].map(k => right[k] * across + up[k] * above + ahead[k] * (depth + this.distance));
  }
  eye() { return this.axes().ahead.map((a, k) => this.target[k] - a * this.distance); }
  orbit(dx, dy) {
    this.azimuth += dx * 0.006;
    this.elevation = Math.min(Math.max(this.elevation + dy * 0.006, -Math.PI / 2), Math.PI / 2);
  }
  // By pixels of a view of this height; what is at the target stays under the pointer.
  pan(dx, dy, height) {
    const {right, up} = this.axes(), scale = 2 * this.distance * Camera.slope / height;
    for (let k = 0; k < 3; ++k) this.target[k] += scale * (dy * up[k] - dx * right[k]);
  }
  zoom(factor) { this.distance = Math.min(Math.max(this.distance * factor, 0.05), 5000); }
  // From metres to clip space, by columns.
  matrix(aspect) {
    const {right, up, ahead} = this.axes(), eye = this.eye(), s = 1 / Camera.slope;
    const near = this.distance / 50, far = this.distance * 40 + 100;
    const rows = [right.map(v => v * s / aspect), up.map(v => v * s),
                  ahead.map(v => v * (far + near) / (far - near)), ahead];
    const shift = rows.map(row => -row.reduce((sum, v, k) => sum + v * eye[k], 0));
    shift[2] -= 2 * far * near / (far - near);
    return new Float32Array([0, 1, 2, 3].flatMap(column => rows.map((row, i) => column < 3 ? row[column] : shift[i])));
  }
}
Camera.slope = Math.tan(0.3);  // of half the height of the view

// Some of the vertices that lie in the box and below the cut; its corners where there are too few.
function someInside(points, [low, high], cut) {
  const inside = [], step = 3 * Math.ceil(points.length / 30000);
  for (let i = 0; i < points.length; i += step) {
    const p = [points[i], points[i + 1], points[i + 2]];
    if (p[2] <= cut && p.every((v, k) => v >= low[k] && v <= high[k])) inside.push(p);
  }
  return inside.length > 10 ? inside : [low, high];
}

// ---- drawing ----

const kSurface = [`#version 300 es
  in vec3 point, normal, color;
  uniform mat4 matrix;
  out vec3 position, direction, shade;
  void main() {
    position = point; direction = normal; shade = color;
    gl_Position = matrix * vec4(point, 1);
  }`, `#version 300 es
  precision highp float;
  in vec3 position, direction, shade;
  uniform vec3 eye;
  uniform float cut, lit;
  out vec4 pixel;
  void main() {
    if (position.z > cut) discard;
    vec3 n = normalize(direction);
    float facing = abs(dot(n, normalize(eye - position)));
    float light = 0.45 + 0.35 * facing + 0.2 * max(n.z, 0.0);
    if (!gl_FrontFacing) light *= 0.6;
    pixel = vec4(shade * mix(1.0, light * 1.06, lit), 1);
  }`];
// Lines of a width in pixels: each vertex knows both ends, and on which side of the line it is.
const kLines = [`#version 300 es
  in vec3 from, to;
  in vec2 place;  // 0 or 1 along the line, -1 or 1 across it
  uniform mat4 matrix;
  uniform vec2 view;
  uniform float width;
  void main() {
    vec4 a = matrix * vec4(from, 1), b = matrix * vec4(to, 1);
    if (a.w < 0.01) a = mix(a, b, (0.01 - a.w) / max(b.w - a.w, 1e-6));
    if (b.w < 0.01) b = mix(b, a, (0.01 - b.w) / max(a.w - b.w, 1e-6));
    vec2 along = (b.xy / b.w - a.xy / a.w) * view;
    along = length(along) > 1e-6 ? normalize(along) : vec2(1, 0);
    gl_Position = place.x < 0.5 ? a : b;
    vec2 aside = vec2(-along.y, along.x) * place.y + along * (2.0 * place.x - 1.0);
    gl_Position.xy += aside * width / view * gl_Position.w;
  }`, `#version 300 es
  precision highp float;
  uniform vec4 ink;
  out vec4 pixel;
  void main() { pixel = vec4(ink.rgb * ink.a, ink.a); }`];

function makeProgram(gl, [vertexText, fragmentText]) {
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertexText], [gl.FRAGMENT_SHADER, fragmentText]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  return program;
}

// An attribute in a buffer of its own; returns the buffer.
function addAttribute(gl, program, name, values, size, kind, normalise) {
  const buffer = gl.createBuffer(), place = gl.getAttribLocation(program, name);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
  gl.enableVertexAttribArray(place);
  gl.vertexAttribPointer(place, size, kind, normalise, 0, 0);
  return buffer;
}

// Line pieces (from, to, from, to ...; metres) as ribbons.
class Lines {
  constructor(gl, program, ends) {
    const from = [], to = [], place = [];
    for (let i = 0; i + 5 < ends.length; i += 6)
      for (const corner of [[0, -1], [0, 1], [1, -1], [1, -1], [0, 1], [1, 1]]) {
        from.push(ends[i], ends[i + 1], ends[i + 2]);
        to.push(ends[i + 3], ends[i + 4], ends[i + 5]);
        place.push(...corner);
      }
    this.count = place.length / 2;
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    addAttribute(gl, program, "from", new Float32Array(from), 3, gl.FLOAT, false);
    addAttribute(gl, program, "to", new Float32Array(to), 3, gl.FLOAT, false);
    addAttribute(gl, program, "place", new Float32Array(place), 2, gl.FLOAT, false);
  }
}

// Squares of a metre (or ten, or a tenth) on the floor below the box.
function gridEnds(low, high, floor) {
  const span = Math.max(high[0] - low[0], high[1] - low[1]);
  const step = span > 60 ? 10 : span > 2 ? 1 : 0.1, ends = [];
  const [x0, y0] = [0, 1].map(k => (Math.floor(low[k] / step) - 1) * step);
  const [x1, y1] = [0, 1].map(k => (Math.ceil(high[k] / step) + 1) * step);
  for (let x = x0; x < x1 + step / 2; x += step) ends.push(x, y0, floor, x, y1, floor);
  for (let y = y0; y < y1 + step / 2; y += step) ends.push(x0, y, floor, x1, y, floor);
  return {ends, step};
}

function pathEnds(path) {
  const ends = [];
  for (let i = 0; i + 5 < path.length; i += 3) ends.push(...path.subarray(i, i + 6));
  return ends;
}

// A little cross of three bars where the path begins.
function startEnds(path, size) {
  if (path.length < 3) return [];
  return [0, 1, 2].flatMap(axis => [-1, 1].flatMap(sign => [0, 1, 2].map(k => path[k] + (k === axis ? sign * size : 0))));
}

class ModelView {
  constructor(box) {
    this.box = box;
    this.canvas = box.querySelector("canvas");
    this.data = JSON.parse(box.querySelector("script").textContent);
    this.gl = this.canvas.getContext("webgl2", {antialias: true});
    if (!this.gl) throw new Error("no WebGL 2");
    this.model = decodeModel(this.data);
    this.camera = new Camera(someInside(this.model.points, this.data.box, this.data.cut));
    this.cut = this.data.cut;
    this.showPath = this.showBack = false;
    this.load();
    this.kind = this.kinds()[0];
    this.setKind(this.kind);
  }
  kinds() {
    return ["colour", "height", "normal", "error", "plain"].filter(
        kind => (kind !== "colour" || this.model.colors) && (kind !== "error" || this.model.errors));
  }
  load() {
    const gl = this.gl, model = this.model;
    this.surface = makeProgram(gl, kSurface);
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    addAttribute(gl, this.surface, "point", model.points, 3, gl.FLOAT, false);
    addAttribute(gl, this.surface, "normal", Int8Array.from(model.normals, v => 127 * v), 3, gl.BYTE, true);
    this.colorBuffer = addAttribute(gl, this.surface, "color", new Uint8Array(model.points.length), 3,
                                    gl.UNSIGNED_BYTE, true);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, model.indices, gl.STATIC_DRAW);
    this.lines = makeProgram(gl, kLines);
    const grid = gridEnds(...this.data.box, this.data.floor);
    this.gridStep = grid.step;
    this.grid = new Lines(gl, this.lines, grid.ends);
    this.path = new Lines(gl, this.lines, pathEnds(model.path));
    const span = Math.hypot(...this.data.box[0].map((low, k) => this.data.box[1][k] - low));
    this.start = new Lines(gl, this.lines, startEnds(model.path, 0.008 * span));
  }
  setKind(kind) {
    this.kind = kind;
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.colorBuffer);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, colorsOf(this.model, this.data, kind), this.gl.STATIC_DRAW);
    this.request();
  }
  request() {
    if (this.requested) return;
    this.requested = true;
    requestAnimationFrame(() => { this.requested = false; this.draw(); });
  }
  resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.round(this.canvas.clientWidth * ratio), height = Math.round(this.canvas.clientHeight * ratio);
    if (width === this.canvas.width && height === this.canvas.height) return;
    this.canvas.width = width;
    this.canvas.height = height;
    if (!this.touched && height > 0) this.camera.reset(width / height);
  }
  aspect() { return this.canvas.width / Math.max(this.canvas.height, 1); }
  drawLines(lines, color, alpha, width, matrix) {
    const gl = this.gl, at = name => gl.getUniformLocation(this.lines, name);
    gl.useProgram(this.lines);
    gl.bindVertexArray(lines.array);
    gl.uniformMatrix4fv(at("matrix"), false, matrix);
    gl.uniform2f(at("view"), this.canvas.width, this.canvas.height);
    gl.uniform1f(at("width"), width * this.canvas.height / Math.max(this.canvas.clientHeight, 1));
    gl.uniform4f(at("ink"), ...color, alpha);
    gl.drawArrays(gl.TRIANGLES, 0, lines.count);
  }
  draw() {
    this.resize();
    const gl = this.gl, at = name => gl.getUniformLocation(this.surface, name), matrix = this.camera.matrix(this.aspect());
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.depthMask(false);
    this.drawLines(this.grid, [0.45, 0.52, 0.6], 0.35, 1, matrix);
    gl.depthMask(true);
    gl.useProgram(this.surface);
    gl.bindVertexArray(this.array);
    this.showBack ? gl.disable(gl.CULL_FACE) : gl.enable(gl.CULL_FACE);
    gl.uniformMatrix4fv(at("matrix"), false, matrix);
    gl.uniform3f(at("eye"), ...this.camera.eye());
    gl.uniform1f(at("cut"), this.cut);
    gl.uniform1f(at("lit"), this.kind === "colour" ? 0.5 : 1);
    gl.drawElements(gl.TRIANGLES, this.model.indices.length, gl.UNSIGNED_INT, 0);
    gl.disable(gl.CULL_FACE);
    if (this.showPath) this.drawPath(matrix);
    if (!this.box.dataset.drawnMs) this.box.dataset.drawnMs = Math.round(performance.now());
  }
  // What the surface hides of the path is faint.
  drawPath(matrix) {
    const gl = this.gl, ink = [0.84, 0.33, 0.13];
    gl.depthMask(false);
    gl.depthFunc(gl.GREATER);
    this.drawLines(this.path, ink, 0.12, 1.5, matrix);
    gl.depthFunc(gl.LEQUAL);
    this.drawLines(this.path, ink, 1, 1.5, matrix);
    gl.disable(gl.DEPTH_TEST);
    this.drawLines(this.start, ink, 1, 3, matrix);
    gl.depthMask(true);
  }
}

// ---- mouse, touch and keys ----

function addPointers(view) {
  const canvas = view.canvas, pointers = new Map();
  const middle = () => [...pointers.values()].reduce((sum, p) => [sum[0] + p[0] / pointers.size, sum[1] + p[1] / pointers.size],
                                                      [0, 0]);
  const spread = () => { const [a, b] = [...pointers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
  canvas.addEventListener("pointerdown", event => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  for (const end of ["pointerup", "pointercancel"])
    canvas.addEventListener(end, event => pointers.delete(event.pointerId));
  canvas.addEventListener("pointermove", event => {
    if (!pointers.has(event.pointerId)) return;
    const before = middle(), apart = pointers.size > 1 ? spread() : 0;
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    const after = middle(), dx = after[0] - before[0], dy = after[1] - before[1];
    view.touched = true;
    if (pointers.size > 1 || event.shiftKey || event.ctrlKey || event.buttons & 6) view.camera.pan(dx, dy, canvas.clientHeight);
    else view.camera.orbit(dx, dy);
    if (apart > 0) view.camera.zoom(apart / Math.max(spread(), 1));
    view.request();
  });
  canvas.addEventListener("contextmenu", event => event.preventDefault());
  // The wheel scrolls the page until the view is clicked.
  canvas.addEventListener("wheel", event => {
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    view.touched = true;
    view.camera.zoom(Math.exp(Math.min(Math.max(event.deltaY, -100), 100) * 0.002));
    view.request();
  }, {passive: false});
}

function addKeys(view) {
  const arrows = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
  view.canvas.addEventListener("keydown", event => {
    const arrow = arrows[event.key];
    if (arrow && event.shiftKey) view.camera.pan(-40 * arrow[0], -40 * arrow[1], view.canvas.clientHeight);
    else if (arrow) view.camera.orbit(20 * arrow[0], 20 * arrow[1]);
    else if (event.key === "+" || event.key === "=") view.camera.zoom(0.85);
    else if (event.key === "-") view.camera.zoom(1 / 0.85);
    else if (event.key === "0" || event.key === "Home") view.camera.reset(view.aspect());
    else return;
    view.touched = true;
    event.preventDefault();
    view.request();
  });
}

function make(parent, tag, text, attributes) {
  const element = document.createElement(tag);
  element.textContent = text;
  for (const name in attributes) element.setAttribute(name, attributes[name]);
  return parent.appendChild(element);
}

function legendOf(view, kind) {
  if (kind !== "height" && kind !== "error") return "";
  const colors = view.data.maps[kind].match(/.{6}/g).map(c => "#" + c).join(",");
  const [low, high] = kind === "height" ? view.data.heights.map(h => (h - view.data.floor).toFixed(1))
                                        : [-1, 1].map(s => (s * view.data.error_limit_m * 1e3).toPrecision(2));
  return `${low}<span class="gradient" style="background:linear-gradient(to right,${colors})"></span>${high} ` +
      (kind === "height" ? "m over the floor" : "mm, red in front of the true surface, blue behind it");
}

function addTools(view) {
  const tools = make(view.box, "div", "", {class: "tools"});
  const choice = make(tools, "span", "", {class: "choice", role: "group", "aria-label": "what colours the surface"});
  const legend = document.createElement("span");
  const choose = kind => {
    view.setKind(kind);
    for (const button of choice.children) button.setAttribute("aria-pressed", button.textContent === kind);
    legend.innerHTML = legendOf(view, kind);
  };
  for (const kind of view.kinds()) make(choice, "button", kind, {type: "button"}).onclick = () => choose(kind);
  const [low, high] = [view.data.floor, view.data.box[1][2]], label = make(tools, "label", "cut at", {});
  const slider = make(label, "input", "", {type: "range", min: 0, max: 1000, "aria-label": "height above which the model is cut away"});
  const height = make(label, "output", "", {});
  slider.value = 1000 * Math.min((view.cut - low) / (high - low), 1);
  const showHeight = () => { height.textContent = slider.value < 1000 ? (view.cut - low).toFixed(2) + " m" : "no cut"; };
  slider.oninput = () => {
    view.cut = slider.value < 1000 ? low + (high - low) * slider.value / 1000 : 1e9;
    showHeight();
    view.request();
  };
  showHeight();
  const addSwitch = (text, property) => {
    const input = document.createElement("input"), name = make(tools, "label", "", {});
    input.type = "checkbox";
    input.checked = view[property];
    input.onchange = () => { view[property] = input.checked; view.request(); };
    name.append(input, text);
  };
  if (view.path.count > 0) {
    view.showPath = true;
    addSwitch("path", "showPath");
  }
  addSwitch("backs of walls", "showBack");
  make(tools, "button", "reset", {type: "button"}).onclick = () => { view.camera.reset(view.aspect()); view.request(); };
  make(view.box, "p", "", {class: "hint"}).append(legend);
  make(view.box, "p", `Drag to turn; right button, Shift or two fingers to move; wheel (after a click), pinch or + and - to zoom. ` +
       `Squares of ${view.gridStep} m.`, {class: "hint"});
  choose(view.kind);
}

function showModel(box) {
  const view = new ModelView(box);
  box.hidden = false;
  document.documentElement.classList.add("modelled");
  addTools(view);
  addPointers(view);
  addKeys(view);
  new ResizeObserver(() => view.request()).observe(view.canvas);
  view.draw();
  box.view = view;
}

if (typeof document !== "undefined")
  for (const box of document.querySelectorAll(".model")) {
    try {
      showModel(box);
    } catch (error) {
      box.hidden = true;  // the figures are shown instead
      box.dataset.error = error.message;
    }
  }
if (typeof module !== "undefined")
  module.exports = {bytesOf, decodeIndices, decodePoints, normalsOf, decodeModel, colorsOf, Camera, gridEnds};
