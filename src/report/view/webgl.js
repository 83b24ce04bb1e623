// The picture by WebGL. One mesh serves every capsule and sphere: its vertices are unit normals that the
// shader moves to the ends of the axis, `x = (a or b) + r n`.
const BODY_VERTEX = `
attribute vec3 p; attribute vec4 q;
uniform mat4 camera; uniform mat3 m; uniform vec3 a, b, h; uniform float r, grow, kind, shadow, ground;
varying vec3 normal, place; varying float above;
void main() {
  vec3 x;
  if (kind < 0.5) {
    vec3 d = b - a; float l = length(d);
    vec3 w = l > 1e-7 ? d / l : vec3(0.0, 0.0, 1.0);
    vec3 u = normalize(cross(abs(w.z) < 0.9 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0), w));
    normal = u * p.x + cross(w, u) * p.y + w * p.z;
    x = mix(a, b, q.w) + (r + grow) * normal;
  } else if (kind < 1.5) {
    normal = m * q.xyz;
    x = a + m * (p * (h + grow));
  } else {
    normal = q.xyz;
    x = p;
  }
  above = x.z - ground;
  if (shadow > 0.5) {
    x.xy -= vec2(0.22, 0.12) * max(x.z - ground, 0.0);
    x.z = ground;
  }
  place = x;
  gl_Position = camera * vec4(x, 1.0);
}`;
const BODY_FRAGMENT = `
precision highp float;
uniform vec4 colour; uniform vec3 eye; uniform float plain, thrown;
varying vec3 normal, place; varying float above;
void main() {
  if (thrown > 0.5 && above < 0.0) discard;
  if (plain > 0.5) { gl_FragColor = vec4(colour.rgb * colour.a, colour.a); return; }
  vec3 v = normalize(eye - place);
  vec3 n = normalize(normal);
  if (dot(n, v) < 0.0) n = -n;
  vec3 l = normalize(vec3(0.22, 0.12, 0.95));
  float direct = max(0.0, (dot(n, l) + 0.3) / 1.3);
  float up = 0.5 + 0.5 * n.z;
  float towards = max(0.0, dot(n, v));
  vec3 base = pow(colour.rgb, vec3(2.2));
  vec3 light = vec3(0.62) * direct + mix(vec3(0.26, 0.26, 0.27), vec3(0.46, 0.48, 0.50), up) + 0.16 * towards;
  vec3 c = base * light;
  c += 0.10 * pow(max(0.0, dot(n, normalize(l + v))), 40.0);
  c += 0.05 * pow(1.0 - towards, 3.0);
  gl_FragColor = vec4(pow(c, vec3(1.0 / 2.2)) * colour.a, colour.a);
}`;
const GRID_VERTEX = `
attribute vec3 p;
uniform mat4 camera; uniform vec3 a, u, v; uniform float size;
varying vec2 uv;
void main() {
  uv = p.xy * size;
  gl_Position = camera * vec4(a + u * uv.x + v * uv.y, 1.0);
}`;
const GRID_FRAGMENT = `
#ifdef GL_OES_standard_derivatives
#extension GL_OES_standard_derivatives : enable
#endif
precision highp float;
uniform vec4 line, fill; uniform float size, stride;
varying vec2 uv;
float lines(float every) {
#ifdef GL_OES_standard_derivatives
  vec2 width = fwidth(uv / every);
#else
  vec2 width = vec2(0.02);
#endif
  vec2 far = abs(fract(uv / every - 0.5) - 0.5) / max(width, 1e-6);
  float fade = 1.0 - smoothstep(0.3, 0.9, max(width.x, width.y));
  return (1.0 - min(min(far.x, far.y), 1.0)) * fade;
}
void main() {
  float edge = 1.0 - smoothstep(0.35, 1.0, length(uv) / size);
  float strength = max(lines(stride) * 0.45, lines(5.0 * stride)) * line.a;
  float alpha = (strength + fill.a * (1.0 - strength)) * edge;
  vec3 c = mix(fill.rgb, line.rgb, strength / max(strength + fill.a * (1.0 - strength), 1e-5));
  gl_FragColor = vec4(c * alpha, alpha);
}`;

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader) || 'shader');
    gl.attachShader(made, shader);
  }
  gl.bindAttribLocation(made, 0, 'p');
  gl.bindAttribLocation(made, 1, 'q');
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made) || 'program');
  const at = {};
  for (let i = gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); i-- > 0;) {
    const { name } = gl.getActiveUniform(made, i);
    at[name] = gl.getUniformLocation(made, name);
  }
  return { made, at };
}

// Vertices of seven numbers: point (or normal of the capsule), normal, end.
function capsuleMesh(round = 22, rows = 6) {
  const [data, index] = [[], []];
  for (let i = 0; i <= 2 * rows + 1; i++) {
    const low = i <= rows;
    const angle = (Math.PI / 2) * ((low ? i : i - 1) / rows - 1);
    for (let k = 0; k <= round; k++) {
      const turn = (2 * Math.PI * k) / round;
      const c = Math.cos(angle);
      data.push(c * Math.cos(turn), c * Math.sin(turn), Math.sin(angle), 0, 0, 0, low ? 0 : 1);
      if (i > 0 && k > 0) {
        const [d, b] = [i * (round + 1) + k, (i - 1) * (round + 1) + k];
        index.push(b - 1, b, d, b - 1, d, d - 1);
      }
    }
  }
  return [data, index];
}

function boxMesh() {
  const [data, index] = [[], []];
  for (let axis = 0; axis < 3; axis++) for (const side of [-1, 1]) {
    const first = data.length / 7;
    for (const [s, t] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) {
      const [p, n] = [[0, 0, 0], [0, 0, 0]];
      p[axis] = n[axis] = side;
      p[(axis + 1) % 3] = s * side;
      p[(axis + 2) % 3] = t;
      data.push(...p, ...n, 0);
    }
    index.push(first, first + 1, first + 2, first, first + 2, first + 3);
  }
  return [data, index];
}

// The faces of a hull, as shares of the box about it.
function hullMesh({ sides }) {
  const data = sides.flatMap(({ corners, normal }) => corners.flatMap((p) => [...p, ...normal, 0]));
  return [data, sides.flatMap((_, i) => [3 * i, 3 * i + 1, 3 * i + 2])];
}

// A tube of five sides along points.
function tubeMesh(points, radius) {
  const [data, index] = [[], []];
  points.forEach((p, i) => {
    const before = points[Math.max(i - 1, 0)];
    const after = points[Math.min(i + 1, points.length - 1)];
    const [u, v] = across(unit(sub(after, before)));
    for (let k = 0; k < 5; k++) {
      const turn = (2 * Math.PI * k) / 5;
      const n = add(mul(u, Math.cos(turn)), mul(v, Math.sin(turn)));
      data.push(...add(p, mul(n, radius)), ...n, 0);
      if (i > 0) {
        const [a, b] = [5 * i + k, 5 * i + ((k + 1) % 5)];
        index.push(a - 5, b - 5, b, a - 5, b, a);
      }
    }
  });
  return [data, index];
}

class WebGL {
  // Throws where there is no WebGL.
  constructor(canvas) {
    const gl = canvas.getContext('webgl', { antialias: true, alpha: true, stencil: true, premultipliedAlpha: true });
    if (!gl) throw new Error('no WebGL');
    this.gl = gl;
    gl.getExtension('OES_standard_derivatives');
    this.body = program(gl, BODY_VERTEX, BODY_FRAGMENT);
    this.grid = program(gl, GRID_VERTEX, GRID_FRAGMENT);
    this.capsule = this.mesh(capsuleMesh());
    this.rough = this.mesh(capsuleMesh(10, 2));
    this.box = this.mesh(boxMesh());
    const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].flatMap(([x, y]) => [x, y, 0, 0, 0, 1, 0]);
    this.quad = this.mesh([corners, [0, 1, 2, 0, 2, 3]]);
    this.tubes = new Map(); // and hulls
    this.plate = this.mesh([[], []], gl.DYNAMIC_DRAW);
  }

  mesh([data, index], usage = this.gl.STATIC_DRAW) {
    const { gl } = this;
    const out = { points: gl.createBuffer(), index: gl.createBuffer() };
    return this.fill(out, [data, index], usage);
  }

  fill(mesh, [data, index], usage) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.points);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(data), usage);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.index);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(index), usage);
    mesh.count = index.length;
    return mesh;
  }

  run(mesh) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.points);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.index);
    gl.enableVertexAttribArray(0);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 28, 0);
    gl.vertexAttribPointer(1, 4, gl.FLOAT, false, 28, 12);
    gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_SHORT, 0);
  }

  // The mesh of an item, its uniforms set.
  item(x) {
    const { gl, body: { at } } = this;
    if (x.kind === 'capsule') {
      gl.uniform1f(at.kind, 0);
      gl.uniform3fv(at.a, x.a);
      gl.uniform3fv(at.b, x.b);
      gl.uniform1f(at.r, x.r);
      return this.capsule;
    }
    if (x.kind === 'box') {
      gl.uniform1f(at.kind, 1);
      gl.uniform3fv(at.a, x.a);
      gl.uniform3fv(at.h, x.h);
      gl.uniformMatrix3fv(at.m, false, x.m);
      if (!x.hull) return this.box;
      if (!this.tubes.has(x.hull)) this.tubes.set(x.hull, this.mesh(hullMesh(x.hull)));
      return this.tubes.get(x.hull);
    }
    gl.uniform1f(at.kind, 2);
    if (x.kind === 'tube') {
      if (!this.tubes.has(x.points)) this.tubes.set(x.points, this.mesh(tubeMesh(x.points, x.r)));
      return this.tubes.get(x.points);
    }
    // a plate: a fan
    const n = unit(cross(sub(x.points[1], x.points[0]), sub(x.points[2], x.points[0])));
    const fan = x.points.slice(2).flatMap((_, i) => [0, i + 1, i + 2]);
    return this.fill(this.plate, [x.points.flatMap((p) => [...p, ...n, 0]), fan], gl.DYNAMIC_DRAW);
  }

  paint(x) {
    const { gl, body: { at } } = this;
    gl.uniform4f(at.colour, ...x.colour, x.alpha);
    gl.uniform1f(at.plain, x.plain ? 1 : 0);
    this.run(this.item(x));
  }

  floor(x, matrix) {
    const { gl, grid: { made, at } } = this;
    gl.useProgram(made);
    gl.uniformMatrix4fv(at.camera, false, matrix);
    gl.uniform3fv(at.a, x.a);
    gl.uniform3fv(at.u, x.u);
    gl.uniform3fv(at.v, x.v);
    gl.uniform1f(at.size, x.size);
    gl.uniform1f(at.stride, x.step);
    gl.uniform4f(at.line, ...x.line, x.strength);
    gl.uniform4f(at.fill, ...x.colour, x.alpha);
    this.run(this.quad);
  }

  // Soft shadows on the ground: the same things flattened, a little larger each time, and no pixel
  // darkened twice by one of them.
  shadows(items, ground, spread) {
    const { gl, body: { at } } = this;
    gl.enable(gl.STENCIL_TEST);
    gl.uniform1f(at.shadow, 1);
    gl.uniform1f(at.thrown, 1);
    gl.uniform1f(at.ground, ground);
    gl.uniform1f(at.plain, 1);
    gl.uniform4f(at.colour, 0.1, 0.14, 0.18, 0.05);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.REPLACE);
    for (const [layer, grow] of [-1, -0.4, 0.2, 0.8, 1.5].entries()) {
      gl.stencilFunc(gl.GREATER, layer + 1, 255);
      for (const x of items) {
        const room = x.kind === 'capsule' ? x.r : x.kind === 'box' ? Math.min(...x.h) : 0;
        gl.uniform1f(at.grow, Math.max(grow * spread, -0.7 * room));
        const mesh = this.item(x);
        this.run(mesh === this.capsule ? this.rough : mesh);
      }
    }
    gl.uniform1f(at.grow, 0);
    gl.uniform1f(at.shadow, 0);
    gl.uniform1f(at.thrown, 0);
    gl.disable(gl.STENCIL_TEST);
  }

  draw(scene, camera, width, height) {
    const { gl } = this;
    const matrix = camera.matrix(width / height);
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.disable(gl.CULL_FACE);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const { made, at } = this.body;
    const start = () => {
      gl.useProgram(made);
      gl.uniformMatrix4fv(at.camera, false, matrix);
      gl.uniform3fv(at.eye, camera.eye());
      gl.uniform1f(at.grow, 0);
      gl.uniform1f(at.shadow, 0);
    };
    const solid = scene.items.filter((x) => x.alpha >= 1);
    const depth = (x) => -norm(sub(x.a || x.points[0], camera.eye()));
    const pale = scene.items.filter((x) => x.alpha < 1).sort((x, y) => depth(x) - depth(y));
    start();
    solid.filter((x) => !x.top).forEach((x) => this.paint(x));
    gl.depthMask(false);
    for (const x of scene.grids) this.floor(x, matrix);
    start();
    if (!this.frugal && camera.eye()[2] > scene.ground) {
      const thrown = scene.items.filter((x) => x.shadow);
      this.shadows(thrown, scene.ground + 2e-4 * camera.distance, scene.spread);
    }
    // of pale volumes only the nearest surface: their depth first
    const ghosts = pale.filter((x) => x.ghost);
    if (ghosts.length) {
      gl.depthMask(true);
      gl.colorMask(false, false, false, false);
      ghosts.forEach((x) => this.paint(x));
      gl.colorMask(true, true, true, true);
      gl.depthMask(false);
      ghosts.forEach((x) => this.paint(x));
    }
    gl.enable(gl.CULL_FACE);
    pale.filter((x) => !x.ghost && x.kind !== 'plate').forEach((x) => this.paint(x));
    gl.disable(gl.CULL_FACE);
    pale.filter((x) => x.kind === 'plate').forEach((x) => this.paint(x));
    gl.depthMask(true);
    // what lies on top shows faintly through everything
    const top = solid.filter((x) => x.top);
    gl.disable(gl.DEPTH_TEST);
    top.forEach((x) => this.paint({ ...x, alpha: 0.45, plain: true }));
    gl.enable(gl.DEPTH_TEST);
    top.forEach((x) => this.paint(x));
  }
}
