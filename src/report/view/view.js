// The view itself: its controls, and what they do.
const CONTROLS = `
<div class="stage"><canvas tabindex="0"></canvas><dl></dl><output class="distance"></output><output class="name" hidden></output></div>
<div class="scrub"><canvas class="strip" aria-hidden="true"></canvas><input type="range" min="0" aria-label="Time"></div>
<div class="keys">
<button type="button" class="play"><i></i><span>Play</span></button>
<span class="time"></span>
<label>Speed <select><option>0.25</option><option>0.5</option><option selected>1</option><option>2</option><option>4</option></select></label>
<button type="button" class="reset">Reset view</button>
<span class="show"></span>
<span class="scale"><span>limit used</span> 50<i></i>100&nbsp;%</span>
</div>`;
const HELP = 'Drag to turn, right button or Shift to shift, wheel after a click to come closer; fingers do the same. '
  + 'Space plays, arrow keys step through time, Shift and arrow keys turn, plus and minus come closer, 0 resets the view.';
const SHOWN = [['volumes', 'Volumes'], ['skeleton', 'Skeleton'], ['path', 'Path'], ['closest', 'Closest pair']];

class View {
  constructor(root) {
    this.root = root;
    this.model = new Model(JSON.parse(root.querySelector('script').textContent));
    this.t = 0;
    this.speed = 1;
    this.playing = false;
    root.insertAdjacentHTML('beforeend', CONTROLS);
    this.stage = root.querySelector('.stage');
    this.canvas = this.stage.querySelector('canvas');
    this.canvas.setAttribute('role', 'img');
    this.canvas.setAttribute('aria-label', `${root.getAttribute('aria-label')}. ${HELP}`);
    this.slider = root.querySelector('input[type=range]');
    const { model } = this;
    Object.assign(this.slider, { max: model.end, step: 'any', value: 0 });
    const bare = !model.volumes.length;
    this.show = { volumes: true, skeleton: bare, path: true, closest: true };
    const absent = { volumes: bare, path: model.trace.length < 2, closest: !model.closest };
    if (bare) this.show.volumes = false;
    for (const [key, text] of SHOWN) if (!absent[key]) this.box(key, text);
    if (!model.uses.some((row) => row.some((x) => x > 0))) root.querySelector('.scale').remove();
    this.camera = new Camera(model.centre, model.radius, model.corners);
    this.open();
    this.listen();
    this.resize();
    this.home();
    root.dataset.ready = this.renderer instanceof Flat ? 'canvas' : 'webgl';
  }

  // WebGL, or a plain canvas in its place.
  open() {
    try {
      this.renderer = new WebGL(this.canvas);
    } catch (e) {
      const plain = this.canvas.cloneNode();
      this.canvas.replaceWith(plain);
      this.canvas = plain;
      this.renderer = new Flat(plain);
    }
  }

  box(key, text) {
    const label = document.createElement('label');
    const box = document.createElement('input');
    Object.assign(box, { type: 'checkbox', checked: this.show[key], name: key });
    box.addEventListener('change', () => { this.show[key] = box.checked; this.later(); });
    label.append(box, ` ${text}`);
    this.root.querySelector('.show').append(label);
  }

  listen() {
    const { root, slider } = this;
    root.querySelector('.play').addEventListener('click', () => this.play(!this.playing));
    root.querySelector('.reset').addEventListener('click', () => this.home());
    root.querySelector('select').addEventListener('change', (e) => { this.speed = Number(e.target.value); });
    slider.addEventListener('input', () => { this.play(false); this.seek(Number(slider.value)); });
    root.addEventListener('keydown', (e) => this.key(e));
    new ResizeObserver(() => this.resize()).observe(this.stage);
    window.addEventListener('beforeprint', () => this.paint());
    this.gestures();
  }

  // Pictures lost with the graphics card come back on a plain canvas.
  gestures() {
    const { canvas } = this;
    const held = new Map();
    canvas.addEventListener('webglcontextlost', (e) => {
      e.preventDefault();
      const plain = canvas.cloneNode();
      canvas.replaceWith(plain);
      this.canvas = plain;
      this.renderer = new Flat(plain);
      this.gestures();
      this.resize();
    });
    canvas.addEventListener('contextmenu', (e) => e.preventDefault());
    canvas.addEventListener('pointerdown', (e) => {
      canvas.setPointerCapture(e.pointerId);
      held.set(e.pointerId, [e.clientX, e.clientY]);
      canvas.focus({ preventScroll: true });
    });
    const release = (e) => held.delete(e.pointerId);
    canvas.addEventListener('pointerup', release);
    canvas.addEventListener('pointercancel', release);
    canvas.addEventListener('pointermove', (e) => {
      const old = held.get(e.pointerId);
      this.hover(old ? null : e);
      if (!old) return;
      const now = [e.clientX, e.clientY];
      const [dx, dy] = [now[0] - old[0], now[1] - old[1]];
      if (held.size === 1) {
        const shift = e.shiftKey || (e.pointerType === 'mouse' && e.buttons & 6);
        if (shift) this.camera.pan(dx, dy, this.height, this.width);
        else this.camera.orbit(0.008 * dx, 0.008 * dy);
      } else {
        const other = [...held].find(([id]) => id !== e.pointerId)[1];
        const apart = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]) || 1;
        this.camera.zoom(apart(old) / apart(now));
        this.camera.pan(0.5 * dx, 0.5 * dy, this.height, this.width);
      }
      held.set(e.pointerId, now);
      this.later();
    });
    canvas.addEventListener('pointerleave', () => this.hover(null));
    canvas.addEventListener('wheel', (e) => {
      // the page scrolls until the view has been clicked
      if (document.activeElement !== canvas && !e.ctrlKey) return;
      e.preventDefault();
      const pixels = e.deltaY * (e.deltaMode === 1 ? 16 : 1);
      this.camera.zoom(Math.exp(clamp(pixels, -200, 200) * 0.0015));
      this.later();
    }, { passive: false });
  }

  // The name of what the pointer is over.
  hover(e) {
    const label = this.root.querySelector('.name');
    let [best, first] = ['', Infinity];
    if (e && this.scene) {
      const ray = this.camera.ray(e.offsetX, e.offsetY, this.width, this.height);
      for (const x of this.scene.items) {
        const at = x.name || x.joint >= 0 ? meets(x, this.camera.eye(), ray) : Infinity;
        if (at < first) [best, first] = [this.model.name(x, this.t), at];
      }
    }
    label.hidden = best === '';
    if (best === '') return;
    label.textContent = best;
    label.style.left = `${Math.min(e.offsetX + 14, this.width - 8 * best.length)}px`;
    label.style.top = `${e.offsetY + 16}px`;
  }

  key(e) {
    if (e.altKey || e.ctrlKey || e.metaKey || e.target.matches('select')) return;
    const { key, shiftKey } = e;
    if (key === ' ' && e.target.matches('button, [type=checkbox]')) return;
    const ways = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const way = ways[key];
    const pause = (t) => { this.play(false); this.seek(clamp(t, 0, this.model.end)); };
    if (key === ' ') this.play(!this.playing);
    else if (way && shiftKey) this.camera.orbit(-0.1 * way[0], 0.1 * way[1]);
    else if (way) pause(this.t + (way[0] + 5 * way[1]) * Math.max(this.model.step, 0.01));
    else if (key === 'Home') pause(0);
    else if (key === 'End') pause(this.model.end);
    else if (key === '+' || key === '=') this.camera.zoom(1 / 1.15);
    else if (key === '-') this.camera.zoom(1.15);
    else if (key === '0') this.home();
    else return;
    e.preventDefault();
    this.later();
  }

  play(on) {
    if (on === this.playing) return;
    this.playing = on;
    const button = this.root.querySelector('.play');
    button.classList.toggle('on', on);
    button.querySelector('span').textContent = on ? 'Pause' : 'Play';
    this.last = null;
    this.later();
  }

  seek(t) {
    this.t = t;
    this.later();
  }

  // The camera as it was at first.
  home() {
    this.camera.fit(this.width, this.height);
    this.later();
  }

  // One picture with the next frame of the screen.
  later() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame((now) => {
      this.waiting = false;
      if (this.playing) {
        const passed = this.last === null ? 0 : Math.min((now - this.last) / 1000, 0.25);
        if (this.last !== null) this.hurry(now - this.last);
        this.last = now;
        this.t += passed * this.speed;
        if (this.t > this.model.end) this.t = this.model.end > 0 ? this.t % this.model.end : 0;
        this.later();
      }
      this.paint();
    });
  }

  // Where pictures come too slowly, as without a graphics card, shadows go first, then sharpness.
  hurry(milliseconds) {
    this.slow = milliseconds > 90 ? (this.slow || 0) + 1 : 0;
    if (this.slow < 4 || this.coarse) return;
    this.slow = 0;
    this.coarse = this.renderer.frugal === true;
    this.renderer.frugal = true;
    this.resize();
  }

  resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, this.coarse ? 0.7 : 2);
    this.width = Math.max(this.stage.clientWidth, 1);
    this.height = Math.max(this.stage.clientHeight, 1);
    this.canvas.width = Math.round(this.width * ratio);
    this.canvas.height = Math.round(this.height * ratio);
    this.strip();
    this.paint();
  }

  // Most used limit over time, as a strip of colour above the slider; a mark at the least distance.
  strip() {
    const strip = this.root.querySelector('.strip');
    const { model } = this;
    const wide = (strip.width = Math.max(strip.clientWidth, 1));
    const high = (strip.height = Math.max(strip.clientHeight, 1));
    const pen = strip.getContext('2d');
    for (let x = 0; x < wide; x++) {
      const most = model.most(model.nearest((x / wide) * model.end));
      const c = ramp(PALE, most ? most.used : 0);
      pen.fillStyle = `rgb(${c.map((v) => Math.round(255 * v)).join(',')})`;
      pen.fillRect(x, 0, 1, high);
    }
    if (model.distance) {
      pen.fillStyle = `rgb(${INK.map((v) => Math.round(255 * v)).join(',')})`;
      pen.fillRect(clamp((model.times[model.least] / (model.end || 1)) * wide - 1, 0, wide - 2), 0, 2, high);
    }
  }

  paint() {
    const { model, root } = this;
    const scene = model.scene(this.t, this.show);
    this.scene = scene;
    this.renderer.draw(scene, this.camera, this.width, this.height);
    const label = root.querySelector('.distance');
    const at = scene.label && this.camera.project(scene.label.at, this.width, this.height);
    label.hidden = !at;
    if (at) {
      label.textContent = scene.label.text;
      label.style.left = `${clamp(at.x, 0, this.width - 60).toFixed(1)}px`;
      label.style.top = `${clamp(at.y, 0, this.height - 24).toFixed(1)}px`;
    }
    const time = `${this.t.toFixed(2)} s`;
    root.querySelector('.time').textContent = `${time} of ${model.end.toFixed(2)} s`;
    this.slider.value = this.t;
    this.slider.setAttribute('aria-valuetext', time);
    root.dataset.time = this.t.toFixed(3);
    this.read(model.nearest(this.t));
  }

  // Clearance and most used limit in words.
  read(i) {
    if (i === this.said) return;
    this.said = i;
    const { model } = this;
    const rows = [];
    if (model.distance) {
      const pair = (k) => model.closest.pairs[model.closest.pair[k]].join(' \u2013 ');
      const at = model.times[model.least];
      rows.push(['least clearance now', model.room(i), pair(i)]);
      rows.push(['least of all', model.room(model.least), `${pair(model.least)} at ${at.toFixed(2)} s`, at]);
    }
    const most = model.most(i);
    if (most) rows.push(['most used limit', `${(100 * most.used).toFixed(0)} %`, `${most.kind} of ${most.joint}`]);
    const list = this.root.querySelector('dl');
    list.replaceChildren(...rows.flatMap(([name, value, remark, where]) => {
      const [dt, dd, strong, small] = ['dt', 'dd', 'strong', 'small'].map((x) => document.createElement(x));
      dt.textContent = name;
      strong.textContent = value;
      small.textContent = remark;
      dd.append(strong, ' ', small);
      if (where !== undefined) {
        const go = document.createElement('button');
        Object.assign(go, { type: 'button', className: 'go', textContent: 'show' });
        go.addEventListener('click', () => { this.play(false); this.seek(where); });
        dd.append(' ', go);
      }
      return [dt, dd];
    }));
  }
}

for (const root of document.querySelectorAll('.view:not([data-ready])')) new View(root);
