"use strict";
/* The map of the page: pan and zoom, a run in motion, shares of runs above a threshold, values at a place. */

const MISSING = 65535;

async function inflate(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/* Reads what pipeline.report.packing.pack wrote: rows of differences, low bytes before high ones. */
async function unpack(text, row) {
  const bytes = await inflate(text), n = bytes.length / 2, found = new Uint16Array(n);
  for (let i = 0, last = 0; i < n; i++) {
    if (i % row === 0) last = 0;
    const signless = bytes[i] | (bytes[n + i] << 8);
    last = (last + ((signless >>> 1) ^ -(signless & 1))) & 0xffff;
    found[i] = last;
  }
  return found;
}

function digits(value, count = 3) {
  if (value === null || Number.isNaN(value)) return "–";
  if (value !== 0 && Math.abs(value) < 1e-4) return value.toExponential(1);
  return String(Number(value.toPrecision(Math.max(count, Math.ceil(Math.log10(Math.abs(value) + 1))))));
}

class Explorer {
  constructor(root, data) {
    Object.assign(this, { root, data, mode: "run", at: null, time: 0, chosen: 0, playing: 0 });
    this.canvas = this.find("map");
    this.cells = data.grid.nx * data.grid.ny;
    this.frames = new Map();
    this.quantity = { run: "depth", all: "depth" };
  }

  find(role) { return this.root.querySelector(`[data-role="${role}"]`); }

  async start() {
    const { data } = this, { nx } = data.grid;
    this.field = {};
    for (const name of Object.keys(data.fields)) this.field[name] = await unpack(data.fields[name], nx);
    if (data.ground) {
      this.elevation = await unpack(data.ground.elevation, nx);
      this.grey = await unpack(data.ground.grey, nx);
    }
    this.place();
    this.contours = (data.ground?.contours ?? []).map(({ level, line }) => {
      const places = [];
      for (let i = 0; i < line.length; i += 2) places.push(this.onMap(line[i], line[i + 1]));
      return { level, places };
    });
    this.listen();
    const middle = data.runs.filter((run) => run.computed && run.reach !== null);
    this.chosen = data.runs.indexOf(middle[Math.floor((middle.length - 1) / 2)] ?? data.runs.find((r) => r.computed));
    this.fit();
    this.drawCurve();
    await this.choose(this.chosen);
    this.root.dataset.ready = "true";
    performance.mark("map ready");
  }

  /* ---- where things lie: cells, metres on the map, pixels of the screen ---- */

  place() {
    const g = this.data.grid;
    const turn = g.origin ? (g.azimuth * Math.PI) / 180 : Math.PI / 2;
    const [east, north] = g.origin ? [Math.sin(turn), Math.cos(turn)] : [1, 0];
    const along = g.s ?? null, first = along ? along[0] : g.x0;
    const step = along ? ((along[along.length - 1] - first) / (along.length - 1)) * g.block : g.dx;
    const [e0, n0] = g.origin ?? [0, 0];
    this.axis = { east, north, first, step, e0, n0 };
    this.column = Array.from({ length: g.nx }, (_, k) => k);
    if (along) {
      // columns of the picture are even on the map, those of the lattice along the bed
      for (let k = 0, i = 0; k < g.nx; k++) {
        const s = first + k * step;
        while (i + 1 < along.length && Math.abs(along[i + 1] - s) <= Math.abs(along[i] - s)) i++;
        this.column[k] = Math.min(g.nx - 1, Math.floor(i / g.block));
      }
    }
  }

  onMap(x, y) {
    const g = this.data.grid, a = this.axis;
    if (!g.s) return [x, y];
    const place = Math.min(Math.max(((x - g.x0) / g.dx) * g.block, 0), g.s.length - 1);
    const i = Math.min(Math.floor(place), g.s.length - 2), s = g.s[i] + (place - i) * (g.s[i + 1] - g.s[i]);
    return [a.e0 + s * a.east - y * a.north, a.n0 + s * a.north + y * a.east];
  }

  /* Column of the picture and row of the lattice of a place on the map; null outside. */
  cell(e, n) {
    const g = this.data.grid, a = this.axis;
    const s = (e - a.e0) * a.east + (n - a.n0) * a.north, y = (n - a.n0) * a.east - (e - a.e0) * a.north;
    const k = Math.floor((s - a.first) / a.step + g.half), j = Math.floor((y - g.y0) / g.dy + g.half);
    return k >= 0 && k < g.nx && j >= 0 && j < g.ny ? { k, j, i: j * g.nx + this.column[k], y } : null;
  }

  corners() {
    const g = this.data.grid, a = this.axis, found = [];
    for (const [k, j] of [[0, 0], [g.nx, 0], [g.nx, g.ny], [0, g.ny]]) {
      const s = a.first + (k - g.half) * a.step, y = g.y0 + (j - g.half) * g.dy;
      found.push([a.e0 + s * a.east - y * a.north, a.n0 + s * a.north + y * a.east]);
    }
    return found;
  }

  fit() {
    const es = this.corners().map((c) => c[0]), ns = this.corners().map((c) => c[1]);
    const [w, e, s, n] = [Math.min(...es), Math.max(...es), Math.min(...ns), Math.max(...ns)];
    // as high as the map asks for, within the screen
    const wanted = Math.max(260, (1.05 * this.canvas.getBoundingClientRect().width * (n - s)) / (e - w));
    this.canvas.style.height = `min(62vh, 34rem, ${Math.round(wanted)}px)`;
    const box = this.canvas.getBoundingClientRect(), ratio = window.devicePixelRatio || 1;
    this.canvas.width = Math.max(1, Math.round(box.width * ratio));
    this.canvas.height = Math.max(1, Math.round(box.height * ratio));
    const scale = 0.96 * Math.min(this.canvas.width / (e - w), this.canvas.height / (n - s));
    this.view = { scale, e: (w + e) / 2, n: (s + n) / 2 };
  }

  toScreen(e, n) {
    const v = this.view;
    return [this.canvas.width / 2 + (e - v.e) * v.scale, this.canvas.height / 2 - (n - v.n) * v.scale];
  }

  toMap(px, py) {
    const v = this.view;
    return [v.e + (px - this.canvas.width / 2) / v.scale, v.n - (py - this.canvas.height / 2) / v.scale];
  }

  zoom(factor, px = this.canvas.width / 2, py = this.canvas.height / 2) {
    const [e, n] = this.toMap(px, py), v = this.view;
    v.scale = Math.min(Math.max(v.scale * factor, 1e-4), 1e4);
    const [e1, n1] = this.toMap(px, py);
    v.e += e - e1;
    v.n += n - n1;
    this.draw();
  }

  /* ---- values ---- */

  run() { return this.data.runs[this.chosen]; }

  value(name, run, i) {
    const held = this.field[name][run.run * this.cells + i];
    if (!run.computed || held === MISSING) return NaN;
    if (name !== "arrival_time") return held * this.data.steps[name];
    return held === 0 ? null : (held - 1) * this.data.steps[name];
  }

  threshold() {
    const listed = this.data.thresholds[this.quantity.all];
    return listed ? listed[Number(this.find("threshold").value)] : 0;
  }

  /* Weight of each run, of all events or of those of one return period. */
  weights() {
    const found = new Float64Array(this.data.runs.length), period = Number(this.find("period")?.value ?? 0);
    if (period > 0) {
      const chosen = this.data.periods[period - 1];
      chosen.runs.forEach((run, i) => { found[run] = chosen.weights[i]; });
    } else for (const run of this.data.runs) found[run.run] = run.weight;
    return found;
  }

  /* Share of runs above the threshold over all cells: of those that were computed, or a bound of it. */
  shares() {
    const bound = this.find("bound").value;
    const name = { depth: "max_depth", speed: "max_speed", arrival: "arrival_time" }[this.quantity.all];
    const limit = name === "arrival_time" ? 0 : Math.round(this.threshold() / this.data.steps[name]);
    const weight = this.weights(), field = this.field[name];
    const above = new Float64Array(this.cells), open = new Float64Array(this.cells);
    let held = 0, missing = 0;
    for (const run of this.data.runs) {
      const w = weight[run.run];
      if (!run.computed) missing += w;
      if (!run.computed || !w) continue;
      held += w;
      for (let i = 0, at = run.run * this.cells; i < this.cells; i++, at++) {
        const unknown = field[at] === MISSING && name !== "arrival_time";
        if (field[at] > limit && !unknown) above[i] += w;
        else if (unknown || run.censored) open[i] += w;
      }
    }
    if (bound === "lower") return above;
    if (bound === "upper") return above.map((w, i) => Math.min(1, w + open[i] + missing));
    if (bound === "open") return open.map((w) => w + missing);
    return above.map((w) => (held ? w / held : NaN));
  }

  /* The same at one cell, with the bounds of runs that are missing, overrun or cut off. */
  shareAt(i, name, limit) {
    const weight = this.weights();
    let held = 0, lower = 0, open = 0;
    for (const run of this.data.runs) {
      const w = weight[run.run], value = this.field[name][run.run * this.cells + i];
      const known = run.computed && (value !== MISSING || name === "arrival_time");
      if (known) held += w;
      if (known && value > limit) lower += w;
      else if (!known || run.censored) open += w;
    }
    return { estimate: held ? lower / held : NaN, lower, upper: Math.min(1, lower + open) };
  }

  median(i, name) {
    const weight = this.weights();
    const held = this.data.runs
      .filter((run) => run.computed)
      .map((run) => [this.value(name, run, i), weight[run.run]])
      .sort((one, other) => one[0] - other[0]);
    const half = held.reduce((sum, one) => sum + one[1], 0) / 2;
    for (let k = 0, sum = 0; k < held.length; k++) if ((sum += held[k][1]) >= half * (1 - 1e-12)) return held[k][0];
    return NaN;
  }

  async frame(run) {
    const text = this.data.frames.runs[run.run];
    if (!text) return null;
    if (!this.frames.has(run.run)) {
      if (this.frames.size > 6) this.frames.clear();
      this.frames.set(run.run, await unpack(text, this.data.grid.nx));
    }
    return this.frames.get(run.run);
  }

  /* What the picture shows, cell by cell, and by which legend. */
  shown() {
    if (this.mode === "all") return { style: "share", values: this.shares() };
    const run = this.run(), values = new Float64Array(this.cells), q = this.quantity.run;
    const t = this.data.frames.times[this.time], name = { speed: "max_speed", time: "arrival_time" }[q] ?? "max_depth";
    for (let i = 0; i < this.cells; i++) {
      if (q === "depth" && this.current) {
        const held = this.current[this.time * this.cells + i];
        values[i] = held === MISSING ? NaN : held * this.data.steps.max_depth;
      } else {
        values[i] = this.value(name, run, i) ?? NaN;
        // without frames: what had been reached by then
        if (q === "depth" && this.data.frames.times.length) {
          const arrival = this.value("arrival_time", run, i);
          if (!(arrival !== null && arrival <= t)) values[i] = 0;
        }
      }
    }
    return { style: { speed: "speed", time: "time" }[q] ?? "depth", values };
  }

  /* ---- pictures ---- */

  paint() {
    const g = this.data.grid, { style, values } = this.shown();
    const image = new ImageData(g.nx, g.ny), entries = this.data.styles[style].entries;
    const colours = entries.map((one) => [1, 3, 5].map((at) => parseInt(one[2].slice(at, at + 2), 16)));
    const lowest = style === "time" ? -1 : entries[0][0];
    for (let j = 0; j < g.ny; j++) {
      for (let k = 0; k < g.nx; k++) {
        const at = 4 * (j * g.nx + k), value = values[j * g.nx + this.column[k]];
        const row = this.data.ground && this.data.ground.rows > 1 ? j : 0;
        const grey = this.grey ? this.grey[row * g.nx + this.column[k]] : 255;
        let colour = [grey, grey, grey];
        if (value > lowest) {
          let c = entries.length - 1;
          while (c > 0 && value <= entries[c][0]) c--;
          const light = 0.25 + (0.75 * grey) / 255;
          colour = colours[c].map((part) => Math.min(255, part * light));
        }
        image.data.set([...colour, 255], at);
      }
    }
    this.picture = document.createElement("canvas");
    [this.picture.width, this.picture.height] = [g.nx, g.ny];
    this.picture.getContext("2d").putImageData(image, 0, 0);
    this.legend(style, this.mode === "all" ? this.find("bound").selectedOptions[0].dataset.words : "");
    this.draw();
  }

  draw() {
    if (!this.picture) return;
    const ctx = this.canvas.getContext("2d"), g = this.data.grid, a = this.axis, v = this.view;
    const ratio = window.devicePixelRatio || 1;
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    ctx.fillStyle = "#eef1f4";
    ctx.fillRect(0, 0, this.canvas.width, this.canvas.height);
    const s = a.first - g.half * a.step, y = g.y0 - g.half * g.dy;
    const [px, py] = this.toScreen(a.e0 + s * a.east - y * a.north, a.n0 + s * a.north + y * a.east);
    const [dx, dy] = [a.step * v.scale, g.dy * v.scale];
    ctx.setTransform(a.east * dx, -a.north * dx, -a.north * dy, -a.east * dy, px, py);
    ctx.imageSmoothingEnabled = false;
    ctx.drawImage(this.picture, 0, 0);
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    this.drawContours(ctx, ratio);
    const line = (places, colour, width, closed, dash = []) => {
      ctx.setLineDash(dash.map((d) => d * ratio));
      ctx.beginPath();
      places.forEach((p, i) => ctx[i ? "lineTo" : "moveTo"](...this.toScreen(...p)));
      if (closed) ctx.closePath();
      for (const [stroke, wide] of [["#ffffff", width + 1.5], [colour, width]]) {
        ctx.strokeStyle = stroke;
        ctx.lineWidth = wide * ratio;
        ctx.stroke();
      }
      ctx.setLineDash([]);
    };
    line(this.corners(), "#555555", 1, true);
    for (const ring of this.data.releases) line(ring.map((p) => this.onMap(...p)), "#8c510a", 1.5, true, [5, 3]);
    ctx.font = `${12 * ratio}px system-ui, sans-serif`;
    for (const r of this.data.receptors) {
      const places = (r.polygon ?? r.line ?? [r.point]).map((p) => this.onMap(...p));
      if (places.length > 1) line(places, "#111111", 1.5, Boolean(r.polygon));
      if (places.length > 1) continue;
      ctx.beginPath();
      ctx.arc(...this.toScreen(...places[0]), 4 * ratio, 0, 7);
      ctx.fillStyle = "#111111";
      ctx.fill();
    }
    this.names(ctx, ratio);
    if (this.at) {
      const [x, y2] = this.toScreen(...this.at);
      for (const [stroke, wide] of [["#ffffff", 5], ["#d01c8b", 2]]) {
        ctx.strokeStyle = stroke;
        ctx.lineWidth = wide * ratio;
        ctx.beginPath();
        ctx.arc(x, y2, 7 * ratio, 0, 7);
        ctx.stroke();
      }
    }
    this.scaleBar(ctx, ratio);
  }

  /* Places of a mark that are in view, in pixels, so close that nothing stands between them. */
  seen(receptor, ratio) {
    const corners = (receptor.polygon ?? receptor.line ?? [receptor.point]).map((p) => this.toScreen(...this.onMap(...p)));
    if (receptor.polygon) corners.push(corners[0]);
    const found = [corners[0]];
    for (let i = 1; i < corners.length; i++) {
      const [[x0, y0], [x1, y1]] = [corners[i - 1], corners[i]];
      const count = Math.min(500, Math.ceil(Math.hypot(x1 - x0, y1 - y0) / (4 * ratio))) || 1;
      for (let k = 1; k <= count; k++) found.push([x0 + ((x1 - x0) * k) / count, y0 + ((y1 - y0) * k) / count]);
    }
    return found.filter(([x, y]) => x >= 0 && y >= 0 && x <= this.canvas.width && y <= this.canvas.height);
  }

  /* Writes names nearest to their own marks, on no other name, or at the end of a line; none of what is out of view. */
  names(ctx, ratio) {
    const marks = this.data.receptors.map((r) => this.seen(r, ratio)), taken = [], high = 13 * ratio, gap = 4 * ratio;
    const off = ([x, y], [left, top, wide]) => [x - Math.min(Math.max(x, left), left + wide), y - Math.min(Math.max(y, top), top + high)];
    const apart = (places, box) => places.reduce((least, p) => Math.min(least, Math.hypot(...off(p, box))), Infinity);
    this.named = [];
    this.data.receptors.forEach((receptor, i) => {
      const own = marks[i], others = marks.filter((_, k) => k !== i).flat();
      if (!own.length) return;
      const wide = ctx.measureText(receptor.name).width;
      const outside = ([left, top]) => left < 0 || top < 0 || left + wide > this.canvas.width || top + high > this.canvas.height;
      const covers = ([left, top]) => taken.some(([a, b, w]) => left < a + w + gap && a < left + wide + gap && Math.abs(top - b) < high + 1);
      const ends = [[1, -1], [0, 1], [1, 1], [0, -1]].map(([axis, way]) => own.reduce((best, p) => (way * p[axis] > way * best[axis] ? p : best)));
      const beside = [...ends, ...own.filter((_, k) => k % Math.ceil(own.length / 8) === 0)].flatMap(([x, y]) => [
        [x + gap, y - gap - high], [x + gap, y + gap], [x - gap - wide, y - gap - high], [x - gap - wide, y + gap],
        [x - wide / 2, y - gap - high], [x - wide / 2, y + gap], [x + 2 * gap, y - high / 2], [x - 2 * gap - wide, y - high / 2],
      ]).map((corner) => [...corner, wide]);
      const isNear = (box) => !outside(box) && !covers(box) && apart(own, box) > 0 && apart(own, box) < 0.7 * apart(others, box);
      let box = beside.find(isNear);
      const isLed = !box;
      if (isLed) {
        const cost = (one) => one[3] + 5000 * outside(one) + 2000 * covers(one) + 300 * (apart(own, one) < 1)
          + 120 * Math.max(0, 1 - apart(others, one) / (15 * ratio));
        const away = [10, 16, 24, 36, 54, 80, 110].flatMap((far) => Array.from({ length: 24 }, (_, k) => {
          const [c, s] = [Math.cos((k * Math.PI) / 12), Math.sin((k * Math.PI) / 12)];
          const at = own.reduce((best, p) => (p[0] * c + p[1] * s > best[0] * c + best[1] * s ? p : best));
          const [x, y] = [at[0] + c * (far * ratio + wide / 2), at[1] + s * (far * ratio + high / 2)];
          const room = [this.canvas.width - wide, this.canvas.height - high];
          return [Math.max(0, Math.min(x - wide / 2, room[0])), Math.max(0, Math.min(y - high / 2, room[1])), wide, far];
        }));
        box = away.map((one) => [cost(one), one]).reduce((best, one) => (one[0] < best[0] ? one : best))[1];
      }
      taken.push(box);
      this.named.push({ name: receptor.name, box: [box[0], box[1], wide, high], isLed });
      const at = own.reduce((best, p) => (Math.hypot(...off(p, box)) < Math.hypot(...off(best, box)) ? p : best));
      for (const [colour, width] of isLed ? [["#ffffff", 3], ["#111111", 1]] : []) {
        ctx.beginPath();
        ctx.moveTo(...at);
        ctx.lineTo(at[0] - off(at, box)[0], at[1] - off(at, box)[1]);
        ctx.strokeStyle = colour;
        ctx.lineWidth = width * ratio;
        ctx.stroke();
      }
      ctx.lineWidth = 3 * ratio;
      ctx.strokeStyle = "#ffffff";
      ctx.strokeText(receptor.name, box[0], box[1] + 0.8 * high);
      ctx.fillStyle = "#111111";
      ctx.fillText(receptor.name, box[0], box[1] + 0.8 * high);
    });
  }

  /* Lines of equal elevation, every fifth one strong, with their elevation where there is room for it. */
  drawContours(ctx, ratio) {
    const named = [], apart = 90 * ratio, every = 5 * (this.data.ground?.interval ?? 1);
    ctx.font = `${10 * ratio}px system-ui, sans-serif`;
    for (const { level, places } of this.contours) {
      const strong = Math.abs(level / every - Math.round(level / every)) < 1e-6;
      const pixels = places.map((p) => this.toScreen(...p));
      ctx.beginPath();
      pixels.forEach((p, i) => ctx[i ? "lineTo" : "moveTo"](...p));
      ctx.strokeStyle = strong ? "rgba(60,60,60,.75)" : "rgba(60,60,60,.45)";
      ctx.lineWidth = (strong ? 1 : 0.6) * ratio;
      ctx.stroke();
      const inside = ([x, y]) => x > 20 * ratio && y > 20 * ratio && x < this.canvas.width - 40 * ratio
        && y < this.canvas.height - 30 * ratio && !named.some(([a, b]) => Math.hypot(a - x, b - y) < apart);
      for (let i = 1; i < pixels.length; i++) {
        const [[x0, y0], [x1, y1]] = [pixels[i - 1], pixels[i]], length = Math.hypot(x1 - x0, y1 - y0);
        // on a line across a profile beside the flow, which is in the middle
        const part = places.length === 2 ? 0.85 : 0.5, middle = [x0 + part * (x1 - x0), y0 + part * (y1 - y0)];
        if (length < 14 * ratio || !inside(middle)) continue;
        named.push(middle);
        const angle = Math.atan2(y1 - y0, x1 - x0), words = `${digits(level, 4)} m`;
        ctx.save();
        ctx.translate(...middle);
        ctx.rotate(Math.abs(angle) > Math.PI / 2 ? angle + Math.PI : angle);
        ctx.textAlign = "center";
        ctx.textBaseline = "middle";
        ctx.lineWidth = 2.5 * ratio;
        ctx.strokeStyle = "rgba(255,255,255,.8)";
        ctx.strokeText(words, 0, 0);
        ctx.fillStyle = "#444444";
        ctx.fillText(words, 0, 0);
        ctx.restore();
        break;
      }
    }
  }

  scaleBar(ctx, ratio) {
    const most = (0.25 * this.canvas.width) / this.view.scale, power = 10 ** Math.floor(Math.log10(most));
    const length = [5, 2, 1].find((step) => step * power <= most) * power, wide = length * this.view.scale;
    const [x, y] = [12 * ratio, this.canvas.height - 14 * ratio];
    ctx.fillStyle = "rgba(255,255,255,.8)";
    ctx.fillRect(x - 5 * ratio, y - 18 * ratio, wide + 10 * ratio, 26 * ratio);
    ctx.fillStyle = "#111111";
    ctx.fillRect(x, y, wide, 3 * ratio);
    ctx.fillText(`${digits(length)} m`, x, y - 4 * ratio);
    if (!this.data.grid.map) return;
    const [nx, ny] = [this.canvas.width - 18 * ratio, 12 * ratio];
    ctx.beginPath();
    [[0, 0], [6, 18], [0, 14], [-6, 18]].forEach(([dx, dy], i) => ctx[i ? "lineTo" : "moveTo"](nx + dx * ratio, ny + dy * ratio));
    ctx.fill();
    ctx.fillText("N", nx - 4 * ratio, ny + 32 * ratio);
  }

  legend(style, words) {
    const { caption, entries } = this.data.styles[style], box = this.find("legend");
    if (box.dataset.style === style + words) return;
    box.dataset.style = style + words;
    box.replaceChildren();
    const head = document.createElement("b");
    head.textContent = caption + words;
    box.append(head);
    for (const [, , colour, label] of entries) {
      const item = document.createElement("span"), swatch = document.createElement("i");
      swatch.style.background = colour;
      item.append(swatch, label);
      box.append(item);
    }
  }

  /* The curve of run-out: a point a run, to choose one by. */
  drawCurve() {
    const box = this.find("curve"), known = this.data.runs.filter((run) => run.reach !== null && run.computed);
    if (!known.length) return;
    const low = known[0].reach, high = known[known.length - 1].reach, span = high - low || 1;
    const ns = "http://www.w3.org/2000/svg", svg = document.createElementNS(ns, "svg");
    svg.setAttribute("viewBox", "0 0 600 190");
    const whole = known.reduce((sum, run) => sum + run.weight, 0) || 1;
    let left = whole;
    const text = (words, x, y, anchor) => {
      const one = document.createElementNS(ns, "text");
      Object.entries({ x, y, "text-anchor": anchor }).forEach(([k, v]) => one.setAttribute(k, v));
      one.textContent = words;
      svg.append(one);
    };
    text("share of runs that go farther", 4, 14, "start");
    text(`${digits(low)} m`, 20, 185, "start");
    text("run-out", 300, 185, "middle");
    text(`${digits(high)} m`, 590, 185, "end");
    this.points = new Map();
    for (const run of known) {
      left -= run.weight;
      const point = document.createElementNS(ns, "circle"), at = this.data.runs.indexOf(run);
      point.setAttribute("cx", 24 + (560 * (run.reach - low)) / span);
      point.setAttribute("cy", 165 - (140 * Math.max(0, left)) / whole);
      point.setAttribute("r", known.length > 120 ? 3.5 : 5);
      point.addEventListener("click", () => this.choose(at));
      this.points.set(at, point);
      svg.append(point);
    }
    box.replaceChildren(svg);
  }

  async choose(at) {
    this.chosen = Math.min(Math.max(at, 0), this.data.runs.length - 1);
    const run = this.run();
    this.current = await this.frame(run);
    this.find("run").value = this.chosen;
    for (const [i, point] of this.points ?? []) point.classList.toggle("on", i === this.chosen);
    const of = Object.entries(run.of).map(([name, value]) => `${name} ${value}`).join(", ");
    const reach = run.reach === null ? "no run-out" : `run-out ${digits(run.reach)} m`;
    this.find("run-words").textContent = `run ${run.run}: ${run.status}, ${reach}${of ? `; ${of}` : ""}`;
    this.find("frames-words").hidden = Boolean(this.current);
    if (!this.current) this.find("frames-words").textContent = this.data.frames.times.length
      ? "The frames of this run are not in the page: shown is the largest depth where the flow had arrived by then."
      : "Frames were not kept: shown is the largest depth.";
    this.update();
  }

  update() {
    const t = this.data.frames.times, q = this.quantity[this.mode];
    this.find("run-panel").hidden = this.mode !== "run";
    this.find("all-panel").hidden = this.mode !== "all";
    this.find("time-row").hidden = !(this.mode === "run" && q === "depth" && t.length);
    this.find("threshold-row").hidden = q === "arrival";
    if (t.length) this.find("time-words").textContent = `${digits(t[this.time])} s`;
    if (this.mode === "all") {
      const unit = { depth: "m", speed: "m/s" }[q], period = Number(this.find("period")?.value ?? 0);
      this.find("threshold-words").textContent = unit ? `${digits(this.threshold())} ${unit}` : "";
      if (this.find("period")) {
        this.find("period-words").textContent = period ? this.data.periods[period - 1].words : "all events";
      }
    }
    this.paint();
    this.ask();
  }

  /* ---- asking ---- */

  ask() {
    const table = this.find("answer"), at = this.at && this.cell(...this.at);
    this.find("hint").hidden = Boolean(at);
    table.replaceChildren();
    if (!at) return;
    const g = this.data.grid, run = this.run(), steps = this.data.steps, rows = [];
    const range = ({ estimate, lower, upper }) => {
      const [one, two, three] = [estimate, lower, upper].map((value) => digits(value, 2));
      return two === three ? one : `${one} (${two} to ${three})`;
    };
    const unit = (value, words) => (value === null || Number.isNaN(value) ? "–" : `${digits(value)} ${words}`);
    rows.push(["head", "This place"]);
    if (g.map) rows.push(["easting", `${this.at[0].toFixed(0)} m`], ["northing", `${this.at[1].toFixed(0)} m`]);
    if (!g.map || g.s) {
      rows.push(["along the bed", `${digits(g.x0 + this.column[at.k] * g.dx, 4)} m`]);
      rows.push(["across it", `${digits(g.y0 + at.j * g.dy, 4)} m`]);
    }
    if (this.elevation) {
      const row = this.data.ground.rows > 1 ? at.j : 0, z = this.elevation[row * g.nx + this.column[at.k]];
      rows.push(["elevation", `${(this.data.ground.low + z * this.data.ground.step).toFixed(0)} m`]);
    }
    rows.push(["head", `Run ${run.run}`]);
    if (this.current && this.data.frames.times.length) {
      const held = this.current[this.time * this.cells + at.i];
      const t = digits(this.data.frames.times[this.time]);
      rows.push([`depth at ${t} s`, unit(held === MISSING ? NaN : held * steps.max_depth, "m")]);
    }
    const speed = this.value("max_speed", run, at.i), arrival = this.value("arrival_time", run, at.i);
    rows.push(["largest depth", unit(this.value("max_depth", run, at.i), "m"), "depth"]);
    rows.push(["largest speed", unit(speed, "m/s"), "speed"]);
    rows.push(["dynamic pressure", unit((run.density * speed ** 2) / 1000, "kPa")]);
    rows.push(["arrival", arrival === null ? "not reached" : unit(arrival, "s"), "arrival"]);
    const period = Number(this.find("period")?.value ?? 0);
    rows.push(["head", period ? `Events of ${this.data.periods[period - 1].words}` : "All runs"]);
    rows.push(["probability of being reached", range(this.shareAt(at.i, "arrival_time", 0)), "reached"]);
    for (const [q, name, words] of [["depth", "max_depth", "m"], ["speed", "max_speed", "m/s"]]) {
      const listed = this.data.thresholds[q];
      const wanted = this.quantity.all === q ? this.threshold() : listed.find((one) => one >= (q === "depth" ? 0.5 : 1)) ?? listed[0];
      const share = this.shareAt(at.i, name, Math.round(wanted / steps[name]));
      rows.push([`probability of a ${q} above ${digits(wanted)} ${words}`, range(share), `share-${q}`]);
    }
    rows.push(["median of the largest depth", unit(this.median(at.i, "max_depth"), "m"), "median"]);
    for (const [name, value, role] of rows) {
      const row = document.createElement("tr"), first = document.createElement(name === "head" ? "th" : "td");
      if (name === "head") {
        first.colSpan = 2;
        first.textContent = value;
        row.append(first);
      } else {
        const second = document.createElement("td");
        first.textContent = name;
        second.textContent = value;
        if (role) second.dataset.answer = role;
        row.append(first, second);
      }
      table.append(row);
    }
  }

  pick(e, n) {
    this.at = this.cell(e, n) ? [e, n] : null;
    this.draw();
    this.ask();
  }

  /* ---- hands ---- */

  play(on) {
    clearInterval(this.playing);
    this.playing = 0;
    if (on) {
      const last = this.data.frames.times.length - 1;
      if (this.time >= last) this.time = 0;
      this.playing = setInterval(() => {
        if (this.time >= last) return this.play(false);
        this.time += 1;
        this.find("time").value = this.time;
        this.update();
      }, 400);
    }
    this.find("play").textContent = this.playing ? "Pause" : "Play";
  }

  listen() {
    const on = (role, event, act) => this.find(role)?.addEventListener(event, act);
    this.find("run").max = this.data.runs.length - 1;
    this.find("time").max = Math.max(0, this.data.frames.times.length - 1);
    const thresholds = () => {
      const listed = this.data.thresholds[this.quantity.all] ?? [0], slider = this.find("threshold");
      slider.max = listed.length - 1;
      const half = listed.findIndex((one) => one >= (this.quantity.all === "speed" ? 1 : 0.5));
      slider.value = Math.max(0, half);
    };
    thresholds();
    if (this.find("period")) this.find("period").max = this.data.periods.length;
    this.time = Math.max(0, this.data.frames.times.length - 1);
    this.find("time").value = this.time;
    on("time", "input", (event) => { this.time = Number(event.target.value); this.update(); });
    on("run", "input", (event) => this.choose(Number(event.target.value)));
    on("threshold", "input", () => this.update());
    on("period", "input", () => this.update());
    on("bound", "change", () => this.update());
    this.find("bound-row").hidden = this.data.runs.every((run) => run.computed && !run.censored);
    on("play", "click", () => this.play(!this.playing));
    on("in", "click", () => this.zoom(1.5));
    on("out", "click", () => this.zoom(1 / 1.5));
    on("whole", "click", () => { this.fit(); this.draw(); });
    for (const button of this.root.querySelectorAll("[data-mode]")) {
      button.addEventListener("change", () => { this.mode = button.dataset.mode; this.play(false); this.update(); });
    }
    on("run-quantity", "change", (event) => { this.quantity.run = event.target.value; this.play(false); this.update(); });
    on("all-quantity", "change", (event) => { this.quantity.all = event.target.value; thresholds(); this.update(); });
    this.hands();
    new ResizeObserver(() => {
      const { width } = this.canvas.getBoundingClientRect();
      if (width && Math.abs(width - this.wide) > 1) { this.wide = width; this.fit(); this.draw(); }
    }).observe(this.canvas);
    this.wide = this.canvas.getBoundingClientRect().width;
  }

  /* One finger or the mouse moves the map, two fingers or the wheel zoom it, a tap asks. */
  hands() {
    const held = new Map(), ratio = () => this.canvas.width / this.canvas.getBoundingClientRect().width;
    const where = (event) => {
      const box = this.canvas.getBoundingClientRect();
      return [(event.clientX - box.left) * ratio(), (event.clientY - box.top) * ratio()];
    };
    let moved = 0, apart = 0;
    this.canvas.addEventListener("pointerdown", (event) => {
      try { this.canvas.setPointerCapture(event.pointerId); } catch { /* a pointer of a script */ }
      held.set(event.pointerId, where(event));
      moved = held.size > 1 ? Infinity : 0;
      apart = 0;
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (!held.has(event.pointerId)) return;
      const [x, y] = where(event), [x0, y0] = held.get(event.pointerId);
      held.set(event.pointerId, [x, y]);
      if (held.size === 1) {
        moved += Math.hypot(x - x0, y - y0);
        this.view.e -= (x - x0) / this.view.scale;
        this.view.n += (y - y0) / this.view.scale;
        this.draw();
      } else {
        const [one, two] = [...held.values()], now = Math.hypot(one[0] - two[0], one[1] - two[1]);
        if (apart) this.zoom(now / apart, (one[0] + two[0]) / 2, (one[1] + two[1]) / 2);
        apart = now;
      }
    });
    this.canvas.addEventListener("pointerup", (event) => {
      if (held.has(event.pointerId) && moved < 6 * ratio()) this.pick(...this.toMap(...where(event)));
      held.delete(event.pointerId);
    });
    this.canvas.addEventListener("pointercancel", (event) => held.delete(event.pointerId));
    this.canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(-0.0015 * event.deltaY), ...where(event));
    }, { passive: false });
    this.canvas.addEventListener("keydown", (event) => {
      const by = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (event.key === "+" || event.key === "-") this.zoom(event.key === "+" ? 1.5 : 1 / 1.5);
      if (!by) return;
      event.preventDefault();
      this.view.e += (by[0] * 40) / this.view.scale;
      this.view.n += (by[1] * 40) / this.view.scale;
      this.draw();
    });
  }
}

const explorers = [];
for (const root of document.querySelectorAll(".explorer")) {
  const begin = async () => {
    try {
      const one = new Explorer(root, JSON.parse(root.querySelector("script").textContent));
      explorers.push(one);
      await one.start();
    } catch (error) {
      root.querySelector('[data-role="hint"]').textContent = `This browser cannot show the map: ${error.message}`;
      root.dataset.ready = "failed";
    }
  };
  begin();
}
