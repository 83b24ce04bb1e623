// The picture on a plain canvas, where there is no WebGL: things are drawn from far to near, capsules as
// thick round lines, boxes and plates as polygons.
class Flat {
  constructor(canvas) {
    this.pen = canvas.getContext('2d');
    if (!this.pen) throw new Error('no canvas');
  }

  draw(scene, camera, width, height) {
    const { pen } = this;
    const ratio = pen.canvas.width / width;
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.lineCap = pen.lineJoin = 'round';
    this.at = (p) => camera.project(p, width, height);
    for (const grid of scene.grids) this.grid(grid);
    const pieces = scene.items.flatMap((x) => this.pieces(x, camera));
    pieces.sort((x, y) => x.top - y.top || y.depth - x.depth);
    for (const piece of pieces) piece.paint();
    pen.globalAlpha = 1;
  }

  css(c, light = 1) {
    return `rgb(${c.map((x) => Math.round(255 * clamp(x * light, 0, 1))).join(',')})`;
  }

  // What an item is drawn as: pieces with a depth.
  pieces(x, camera) {
    const { pen } = this;
    const piece = (points, paint) => {
      const seen = points.map((p) => this.at(p));
      if (seen.includes(null) || seen.length === 0) return [];
      const depth = seen.reduce((sum, s) => sum + s.depth, 0) / seen.length;
      const act = () => { pen.globalAlpha = x.alpha; paint(seen); };
      return [{ depth, top: x.top ? 1 : 0, paint: act }];
    };
    const polygon = (points, light) => piece(points, (seen) => {
      pen.beginPath();
      seen.forEach((s) => pen.lineTo(s.x, s.y));
      pen.closePath();
      pen.fillStyle = pen.strokeStyle = this.css(x.colour, light);
      pen.lineWidth = 0.5;
      pen.fill();
      pen.stroke();
    });
    if (x.kind === 'capsule') return this.capsule(x, piece);
    if (x.kind === 'tube') {
      return x.points.slice(1).flatMap((p, i) => this.capsule({ ...x, a: x.points[i], b: p, plain: true }, piece));
    }
    if (x.kind === 'plate') return polygon(x.points, 0.95);
    const out = [];
    const shade = (n) => 0.7 + 0.3 * Math.max(0, 0.3 * n[0] + 0.95 * n[2]);
    if (x.hull) {
      for (const side of x.hull.sides) {
        const corners = side.corners.map((c) => add(x.a, turn(x.m, c.map((y, k) => y * x.h[k]))));
        const n = turn(x.m, side.normal);
        if (dot(n, sub(camera.eye(), corners[0])) > 0) out.push(...polygon(corners, shade(n)));
      }
      return out;
    }
    // the three sides of a box that are seen
    for (let k = 0; k < 3; k++) for (const side of [-1, 1]) {
      const axis = (i) => x.m.slice(3 * (i % 3), 3 * (i % 3) + 3);
      const n = mul(axis(k), side);
      const centre = add(x.a, mul(n, x.h[k]));
      if (dot(n, sub(camera.eye(), centre)) <= 0) continue;
      const [u, v] = [mul(axis(k + 1), x.h[(k + 1) % 3]), mul(axis(k + 2), x.h[(k + 2) % 3])];
      const corners = [add(u, v), sub(u, v), mul(add(u, v), -1), sub(v, u)].map((c) => add(centre, c));
      out.push(...polygon(corners, shade(n)));
    }
    return out;
  }

  // A thick line, darker at its rim.
  capsule(x, piece) {
    const { pen } = this;
    return piece([x.a, x.b], ([p, q]) => {
      const wide = x.r * (p.scale + q.scale);
      const dot = Math.hypot(p.x - q.x, p.y - q.y) < 0.01 ? 0.01 : 0;
      const stroke = ([share, shift, light]) => {
        pen.strokeStyle = this.css(x.colour, light);
        pen.lineWidth = Math.max(wide * share, 1);
        pen.beginPath();
        pen.moveTo(p.x, p.y - shift * wide);
        pen.lineTo(q.x + dot, q.y - shift * wide);
        pen.stroke();
      };
      if (x.plain || x.alpha < 1 || wide < 4) { stroke([1, 0, 0.9]); return; }
      [[1, 0, 0.62], [0.86, 0.03, 0.76], [0.66, 0.07, 0.87], [0.42, 0.12, 0.97], [0.18, 0.16, 1.05]].forEach(stroke);
    });
  }

  grid(x) {
    const { pen } = this;
    const reach = Math.min(Math.floor(x.size / x.step), 30);
    pen.strokeStyle = this.css(x.line);
    pen.lineWidth = 0.7;
    for (let i = -reach; i <= reach; i++) for (const [u, v] of [[x.u, x.v], [x.v, x.u]]) {
      const half = Math.sqrt(Math.max(0, reach * reach - i * i)) * x.step;
      const middle = add(x.a, mul(u, i * x.step));
      const ends = [-half, half].map((s) => this.at(add(middle, mul(v, s))));
      if (ends.includes(null)) continue;
      pen.globalAlpha = (i % 5 === 0 ? 0.8 : 0.35) * x.strength;
      pen.beginPath();
      ends.forEach((p) => pen.lineTo(p.x, p.y));
      pen.stroke();
    }
  }
}
