// What the data say: poses, uses and distances at any time, and what there is to draw then.
const UNIT = 1e-5;
const INK = [0.12, 0.16, 0.2];
const KINDS = { p: 'position', v: 'velocity', a: 'acceleration', t: 'torque' };

const hex = (text) => [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16) / 255);
const BLUE = hex('#0072b2');
const ORANGE = hex('#e69f00');
const GREEN = hex('#009e73');
const RED = hex('#d55e00');
const STEEL = hex('#b4c2cf');
const PALE = hex('#d3dbe2');
const BASE = hex('#93a0ad');

// Colour of a link that uses so much of a limit: its own up to one half, then towards orange at 90 %, red
// from the limit on.
function ramp(own, used) {
  if (used <= 0.5) return own;
  if (used < 0.9) return mix(own, ORANGE, (used - 0.5) / 0.4);
  return mix(ORANGE, RED, clamp((used - 0.9) / 0.1, 0, 1));
}

// A column of differences of whole numbers, as metres or parts of a quaternion.
function column(differences) {
  let sum = 0;
  return differences.map((d) => { sum += d; return sum * UNIT; });
}

// Points of a closed curve with one more between any two (Catmull and Rom).
function smooth(points) {
  const n = points.length - 1;
  if (n < 3) return points;
  return points.slice(0, n).flatMap((_, i) => {
    const [p, a, b, q] = [i - 1, i, i + 1, i + 2].map((k) => points[(k + n) % n]);
    return [0, 0.5].map((s) => a.map((_, k) => {
      const [d, e] = [0.5 * (b[k] - p[k]), 0.5 * (q[k] - a[k])];
      return a[k] + s * (d + s * (3 * (b[k] - a[k]) - 2 * d - e + s * (d + e - 2 * (b[k] - a[k]))));
    }));
  }).concat([points[n]]);
}

class Model {
  constructor(data) {
    Object.assign(this, data);
    this.times = column(data.times);
    this.count = this.times.length;
    this.end = this.times[this.count - 1];
    this.step = this.end / Math.max(this.count - 1, 1);
    this.frames = data.frames.map((columns) => columns.map(column));
    this.ends = data.ends.map((columns) => columns.map(column));
    this.points = this.closest ? this.closest.points.map(column) : null;
    this.distance = this.closest ? column(this.closest.distance) : null;
    const path = data.path.map(column);
    this.trace = path.length === 3 ? smooth(path[0].map((_, i) => path.map((c) => c[i]))) : [];
    this.least = this.distance ? this.distance.indexOf(Math.min(...this.distance)) : null;
    this.mounts = polygon(this.lines.flatMap((_, k) => this.still(k)));
    this.measure();
  }

  // Ends of a line that never move: where a closed chain stands on its base.
  still(k) {
    const c = this.ends[k];
    const fixed = (j) => c.slice(j, j + 3).every((row) => row.every((x) => Math.abs(x - row[0]) < 2e-5));
    return [0, 3].filter(fixed).map((j) => c.slice(j, j + 3).map((row) => row[0]));
  }

  // Two samples about a time, and where it lies between them.
  between(t) {
    let [low, high] = [0, this.count - 1];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.times[middle] <= t) low = middle;
      else high = middle;
    }
    const long = this.times[high] - this.times[low];
    return [low, high, long > 0 ? clamp((t - this.times[low]) / long, 0, 1) : 0];
  }

  at(row, [i, k, s]) {
    return row[i] + (row[k] - row[i]) * s;
  }

  nearest(t) {
    const [low, high, share] = this.between(t);
    return share < 0.5 ? low : high;
  }

  pose(body, when) {
    if (body < 0) return { m: [1, 0, 0, 0, 1, 0, 0, 0, 1], p: [0, 0, 0] };
    const x = this.frames[body].map((row) => this.at(row, when));
    const size = Math.hypot(...x.slice(3)) || 1;
    return { p: x.slice(0, 3), m: rotation(x.slice(3).map((v) => v / size)) };
  }

  used(joint, when) {
    return joint < 0 || !this.uses[joint] ? 0 : this.at(this.uses[joint], when) / 1000;
  }

  // Distance of the closest pair at a sample, in words.
  room(i) {
    return `${(1000 * this.distance[i]).toFixed(0).replace('-', '\u2212')} mm`;
  }

  // The joint that uses most of a limit at a sample.
  most(i) {
    let best = null;
    this.uses.forEach((row, j) => {
      if (row[i] > 0 && (!best || row[i] > best.used)) best = { used: row[i], joint: j };
    });
    if (!best) return null;
    return { used: best.used / 1000, joint: this.joints[best.joint], kind: KINDS[this.which[best.joint][i]] };
  }

  // Centre and radius of everything that is drawn, and the height of the ground.
  measure() {
    const low = [Infinity, Infinity, Infinity];
    const high = low.map((x) => -x);
    this.corners = [];
    const take = (p, r = 0) => {
      p.forEach((x, k) => {
        low[k] = Math.min(low[k], x - r);
        high[k] = Math.max(high[k], x + r);
        for (const d of r > 0 ? [-r, r] : [0]) this.corners.push(p.map((y, i) => (i === k ? y + d : y)));
      });
    };
    const around = (x) => {
      if (x.kind !== 'box') return [x.a, x.b];
      const signs = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [i & 1, i & 2, i & 4].map((bit, k) => (bit ? x.h[k] : -x.h[k])));
      return signs.map((s) => add(x.a, turn(x.m, s)));
    };
    take([0, 0, 0]);
    for (let i = 0; i < this.count; i += Math.max(1, Math.floor(this.count / 40))) {
      const when = [i, i, 0];
      for (const x of this.shapes(when)) {
        around(x).forEach((p) => take(p, x.r));
      }
      this.bodies.forEach((_, b) => take(this.pose(b, when).p));
      this.segments(when).forEach((s) => s.ends.forEach((p) => take(p)));
    }
    const own = norm(sub(high, low));
    this.size = own > 0 ? own : 1;
    this.trace.forEach((p) => take(p));
    for (const o of this.obstacles.filter((o) => o.kind !== 'plane')) {
      const x = this.solid(o, this.pose(-1));
      if (norm(x.a) < this.size) around(x).forEach((p) => take(p, x.r));
    }
    this.centre = mix(low, high, 0.5);
    this.radius = 0.5 * norm(sub(high, low)) || 1;
    const floors = this.obstacles.filter((o) => o.kind === 'plane' && o.normal[2] > 0.999);
    this.stated = floors.length > 0;
    this.ground = this.stated ? Math.max(...floors.map((o) => o.offset)) : -low[2] > high[2] ? low[2] : 0;
  }

  // A volume or obstacle as an item of the picture.
  solid(v, pose) {
    if (v.kind === 'hull') {
      v.hull = v.hull || unitHull(v.points, v.faces);
      return { kind: 'box', a: apply(pose, v.hull.centre), m: pose.m, h: v.hull.half, hull: v.hull };
    }
    if (v.kind === 'box') return { kind: 'box', a: apply(pose, v.centre), m: turned(pose.m, rotation(v.turn)), h: v.half };
    if (v.kind === 'sphere') return { kind: 'capsule', a: apply(pose, v.from), b: apply(pose, v.from), r: v.radius };
    return { kind: 'capsule', a: apply(pose, v.from), b: apply(pose, v.to), r: v.radius };
  }

  shapes(when) {
    return this.volumes.map((v) => {
      const joint = v.body < 0 ? -1 : this.bodies[v.body].joint;
      const own = v.body < 0 ? BASE : v.body % 2 ? PALE : STEEL;
      return { ...this.solid(v, this.pose(v.body, when)), colour: ramp(own, this.used(joint, when)), name: v.link, joint };
    });
  }

  // The lines of a closed chain at a time.
  segments(when) {
    return this.lines.map((line, k) => {
      const x = this.ends[k].map((row) => this.at(row, when));
      return { ...line, ends: [x.slice(0, 3), x.slice(3)] };
    });
  }

  // Links as thin rods, joints as short thick ones along their axes; of a closed chain its lines.
  skeleton(when) {
    const rod = (a, b, r, joint, own = STEEL) => {
      return { kind: 'capsule', a, b, r, joint, colour: ramp(own, this.used(joint, when)), alpha: 1 };
    };
    if (this.lines.length) {
      return this.segments(when).flatMap((s) => {
        const r = this.size * (s.plate ? 0.006 : 0.008);
        return [rod(...s.ends, r, s.joint, s.plate ? BLUE : STEEL)];
      });
    }
    const poses = this.bodies.map((_, b) => this.pose(b, when));
    const out = [];
    this.bodies.forEach((body, b) => {
      const from = body.parent < 0 ? [0, 0, 0] : poses[body.parent].p;
      const before = body.parent < 0 ? -1 : this.bodies[body.parent].joint;
      out.push(rod(from, poses[b].p, 0.011 * this.size, before, body.parent < 0 ? BASE : STEEL));
      if (body.tip) out.push(rod(poses[b].p, apply(poses[b], body.tip), 0.011 * this.size, body.joint));
      const axis = mul(turn(poses[b].m, body.axis), 0.02 * this.size);
      out.push(rod(sub(poses[b].p, axis), add(poses[b].p, axis), 0.02 * this.size, body.joint, PALE));
    });
    return out;
  }

  grids() {
    const ground = {
      a: [this.centre[0], this.centre[1], this.ground], u: [1, 0, 0], v: [0, 1, 0], size: 2.2 * this.radius,
      step: this.pitch(), line: hex('#7b8794'), strength: 0.55, colour: hex('#e4e9ed'), alpha: this.stated ? 0.5 : 0.12,
    };
    const walls = this.obstacles.filter((o) => o.kind === 'plane' && o.normal[2] <= 0.999);
    return [ground, ...walls.map((o) => {
      const n = unit(o.normal);
      const [u, v] = across(n);
      const a = add(this.centre, mul(n, o.offset - dot(n, this.centre)));
      return { ...ground, a, u, v, size: 1.3 * this.radius, line: BLUE, colour: BLUE, alpha: 0.06 };
    })];
  }

  // Width of a square of the grid: five of them make a strong line.
  pitch() {
    const power = 10 ** Math.floor(Math.log10(this.radius / 3));
    return this.radius / 3 / power > 3 ? 2 * power : power;
  }

  // What an item is called, and how much its joint uses at a time.
  name(x, t) {
    if (x.joint === undefined || x.joint < 0) return x.name || '';
    const of = (x.name ? `${x.name}, ` : '') + this.joints[x.joint];
    return `${of}: ${(100 * this.used(x.joint, this.between(t))).toFixed(0)} %`;
  }

  // Everything to draw at a time.
  scene(t, show) {
    const when = this.between(t);
    const items = [];
    const bones = show.skeleton || (!this.volumes.length && show.volumes);
    if (show.volumes) {
      const ghost = show.skeleton;
      items.push(...this.shapes(when).map((x) => ({ ...x, alpha: ghost ? 0.35 : 1, ghost, shadow: true })));
    }
    if (bones) {
      items.push(...this.skeleton(when).map((x) => ({ ...x, shadow: true })));
    }
    if (this.lines.length && (bones || show.volumes)) {
      const plate = polygon(this.segments(when).filter((s) => s.plate).flatMap((s) => s.ends));
      if (plate.length && bones) items.push({ kind: 'plate', points: plate, colour: BLUE, alpha: 0.35, shadow: true });
      if (this.mounts.length) items.push({ kind: 'plate', points: this.mounts, colour: BASE, alpha: 0.45 });
    }
    for (const o of this.obstacles) {
      if (o.kind !== 'plane') items.push({ ...this.solid(o, this.pose(-1)), colour: BLUE, alpha: 0.3, shadow: true, name: o.name });
    }
    if (show.path && this.trace.length > 1) {
      items.push({ kind: 'tube', points: this.trace, r: 0.0028 * this.size, colour: GREEN, alpha: 1 });
    }
    let label = null;
    if (this.closest && show.closest) {
      const p = this.points.map((row) => row[this.nearest(t)]);
      const [a, b] = [p.slice(0, 3), p.slice(3)];
      const r = 0.0035 * this.size;
      const line = { kind: 'capsule', colour: RED, alpha: 1, top: true };
      items.push({ ...line, a, b, r }, { ...line, a, b: a, r: 2.2 * r }, { ...line, a: b, b, r: 2.2 * r });
      label = { at: mix(a, b, 0.5), text: this.room(this.nearest(t)) };
    }
    return { items, grids: this.grids(), ground: this.ground, spread: 0.014 * this.size, label };
  }
}

// The hull of points in a plane, none where there are fewer than three.
function polygon(points) {
  const out = points.length > 2 ? hull(points) : [];
  return out.length > 2 ? out : [];
}
