// Vectors, rotations, the camera. World: metres, z up. Matrices are column by column.
const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const mul = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => { const n = norm(a); return n > 0 ? mul(a, 1 / n) : [0, 0, 1]; };
const mix = (a, b, s) => a.map((x, i) => x + (b[i] - x) * s);
const clamp = (x, low, high) => Math.min(high, Math.max(low, x));

// Two axes across a unit vector.
function across(w) {
  const u = unit(cross(Math.abs(w[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0], w));
  return [u, cross(w, u)];
}

// Rotation matrix of a unit quaternion (w, x, y, z), nine numbers.
function rotation([w, x, y, z]) {
  return [
    1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y),
    2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x),
    2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y),
  ];
}
const turn = (m, v) => [
  m[0] * v[0] + m[3] * v[1] + m[6] * v[2],
  m[1] * v[0] + m[4] * v[1] + m[7] * v[2],
  m[2] * v[0] + m[5] * v[1] + m[8] * v[2],
];
const turned = (a, b) => [0, 3, 6].flatMap((k) => turn(a, b.slice(k, k + 3)));
const apply = (pose, v) => add(turn(pose.m, v), pose.p);

// Convex hull of points that lie in one plane, in order; fewer than three where they span none.
function hull(points) {
  const at = points[0];
  let w = null;
  let most = 0;
  for (const p of points) for (const q of points) {
    const c = cross(sub(p, at), sub(q, at));
    if (norm(c) > most) { most = norm(c); w = c; }
  }
  if (!w || most < 1e-9) return [];
  const [u, v] = across(unit(w));
  const flat = points.map((p) => [dot(sub(p, at), u), dot(sub(p, at), v), p]);
  flat.sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (list) => {
    const out = [];
    for (const p of list) {
      while (out.length > 1) {
        const [a, b] = out.slice(-2);
        if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 1e-12) break;
        out.pop();
      }
      out.push(p);
    }
    return out.slice(0, -1);
  };
  return [...half(flat), ...half(flat.reverse())].map((p) => p[2]);
}

// How far along a ray it meets a capsule (nearly, at its axis) or a box; none: infinite.
function meets(x, eye, ray) {
  if (x.kind === 'capsule') {
    const flat = (v) => sub(v, mul(ray, dot(v, ray)));
    const [a, d] = [flat(sub(x.a, eye)), flat(sub(x.b, x.a))];
    const s = dot(d, d) > 0 ? clamp(-dot(a, d) / dot(d, d), 0, 1) : 0;
    const far = norm(add(a, mul(d, s)));
    return far < x.r ? dot(sub(mix(x.a, x.b, s), eye), ray) - Math.sqrt(x.r * x.r - far * far) : Infinity;
  }
  if (x.kind !== 'box') return Infinity;
  let [near, far] = [0, Infinity];
  for (let k = 0; k < 3; k++) {
    const axis = x.m.slice(3 * k, 3 * k + 3);
    const [o, d] = [dot(sub(x.a, eye), axis), dot(ray, axis)];
    const ends = [(o - x.h[k]) / d, (o + x.h[k]) / d];
    near = Math.max(near, Math.min(...ends));
    far = Math.min(far, Math.max(...ends));
  }
  return near < far ? near : Infinity;
}

// A hull in the box about it: the box's centre and half edges, and the faces' corners as shares of these.
function unitHull(points, faces) {
  const range = (pick) => [0, 1, 2].map((k) => pick(...points.map((p) => p[k])));
  const [low, high] = [range(Math.min), range(Math.max)];
  const [centre, half] = [mix(low, high, 0.5), mul(sub(high, low), 0.5)];
  const share = points.map((p) => p.map((x, k) => (x - centre[k]) / half[k]));
  const sides = faces.map((f) => {
    const [a, b, c] = f.map((i) => points[i]);
    return { corners: f.map((i) => share[i]), normal: unit(cross(sub(b, a), sub(c, a))) };
  });
  return { centre, half, sides };
}

// A camera that turns about a point: angles in rad, the distance in metres.
class Camera {
  constructor(centre, radius, points) {
    Object.assign(this, { radius, points, target: centre, yaw: -0.95, pitch: 0.33, distance: 4 * radius });
    this.first = { target: centre, yaw: this.yaw, pitch: this.pitch, distance: this.distance };
  }

  // So that all points fill most of a picture.
  fit(width, height) {
    Object.assign(this, this.first);
    for (let i = 0; i < 8; i++) {
      const seen = this.points.map((p) => this.project(p, width, height)).filter(Boolean);
      if (!seen.length) break;
      const range = (key) => seen.reduce(([a, b], s) => [Math.min(a, s[key]), Math.max(b, s[key])], [Infinity, -Infinity]);
      const [x, y] = [range('x'), range('y')];
      this.pan(0.5 * (width - x[0] - x[1]), 0.5 * (height - y[0] - y[1]), height, width);
      const filled = Math.max((x[1] - x[0]) / (0.9 * width), (y[1] - y[0]) / (0.88 * height));
      this.distance = clamp(this.distance * clamp(filled, 0.5, 2), 0.5 * this.radius, 20 * this.radius);
    }
  }

  orbit(dx, dy) {
    this.yaw -= dx;
    this.pitch = clamp(this.pitch + dy, -1.5, 1.5);
  }

  zoom(factor) {
    this.distance = clamp(this.distance * factor, 0.15 * this.radius, 40 * this.radius);
  }

  // Right, up, and towards the eye.
  axes() {
    const [sy, cy, sp, cp] = [Math.sin(this.yaw), Math.cos(this.yaw), Math.sin(this.pitch), Math.cos(this.pitch)];
    return [[-sy, cy, 0], [-cy * sp, -sy * sp, cp], [cy * cp, sy * cp, sp]];
  }

  eye() {
    return add(this.target, mul(this.axes()[2], this.distance));
  }

  // By pixels of a picture.
  pan(dx, dy, height, width) {
    const [right, up] = this.axes();
    const metres = (2 * this.distance) / (this.focal(width / height) * height);
    this.target = add(this.target, add(mul(right, -dx * metres), mul(up, dy * metres)));
  }

  // Of a picture that is narrow the width decides.
  focal(aspect) {
    return Math.min(1, aspect * 1.15) / Math.tan(0.5 * Camera.FIELD);
  }

  // From the world to the cube of the picture, sixteen numbers.
  matrix(aspect) {
    const [r, u, b] = this.axes();
    const eye = this.eye();
    const f = this.focal(aspect);
    const [near, far] = [0.02 * this.distance, this.distance + 30 * this.radius];
    const [c, d] = [(far + near) / (near - far), (2 * far * near) / (near - far)];
    const rows = [
      [...mul(r, f / aspect), (-f / aspect) * dot(r, eye)],
      [...mul(u, f), -f * dot(u, eye)],
      [...mul(b, c), -c * dot(b, eye) + d],
      [...mul(b, -1), dot(b, eye)],
    ];
    return [0, 1, 2, 3].flatMap((k) => rows.map((row) => row[k]));
  }

  // Pixel of a point, its depth in metres, and pixels a metre there; null behind the eye.
  project(p, width, height) {
    const [r, u, b] = this.axes();
    const v = sub(p, this.eye());
    const depth = -dot(b, v);
    if (depth < 0.02 * this.distance) return null;
    const scale = (0.5 * height * this.focal(width / height)) / depth;
    return { x: 0.5 * width + dot(r, v) * scale, y: 0.5 * height - dot(u, v) * scale, depth, scale };
  }

  // Direction in which the eye sees a pixel.
  ray(x, y, width, height) {
    const [r, u, b] = this.axes();
    const s = 0.5 * height * this.focal(width / height);
    return unit(sub(add(mul(r, (x - 0.5 * width) / s), mul(u, (0.5 * height - y) / s)), b));
  }
}
Camera.FIELD = 0.6;
