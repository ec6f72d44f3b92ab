// Computes positions of discs, and draws discs, walls, paths and marks, for the play page and for replays in reports.
// A track describes the path of one disc: [times, xs, ys], in seconds and metres. Between two times, the disc has a
// constant acceleration. If the track has a fourth list, the list contains this acceleration. If the track has no
// fourth list, the disc flies freely. Colours are CSS variables: --s0 to --s7 for discs, --wall, --ghost (the exact
// run), --wrong, --surface, --ink.
export const make = (name, attributes = {}, ...children) => {
  const e = document.createElement(name);
  for (const [k, v] of Object.entries(attributes))
    if (k.startsWith("on")) e.addEventListener(k.slice(2), v);
    else if (v !== false) e.setAttribute(k, v === true ? "" : v);
  e.append(...children);
  return e;
};
export const digits = (v, n = 3) =>
  v === undefined || v === null || Number.isNaN(v) ? "–" : String(Number(v.toPrecision(n)));
const flightAt = (times, t) => {
  let a = 0,
    b = times.length - 1;
  while (b - a > 1) {
    const m = (a + b) >> 1;
    if (times[m] <= t) a = m;
    else b = m;
  }
  return a;
};
export const placeAt = ([times, xs, ys, pulls], pull, time) => {
  const t = Math.min(Math.max(time, times[0]), times.at(-1)),
    k = flightAt(times, t),
    n = Math.min(k + 1, times.length - 1),
    b = times[k],
    e = times[n];
  const part = e > b ? (t - b) / (e - b) : 0,
    bulge = 0.5 * (t - b) * (t - e),
    [gx, gy] = pulls ? pulls[k] : pull;
  return [xs[k] * (1 - part) + xs[n] * part + bulge * gx, ys[k] * (1 - part) + ys[n] * part + bulge * gy];
};
export const angleAt = ([times, angles], t) => {
  const k = Math.min(flightAt(times, t), times.length - 2),
    d = times[k + 1] - times[k],
    p = d > 0 ? Math.min(Math.max((t - times[k]) / d, 0), 1) : 0;
  return angles[k] * (1 - p) + angles[k + 1] * p;
};
export const spinAt = ([times, angles], t) => {
  const k = Math.min(flightAt(times, t), times.length - 2),
    d = times[k + 1] - times[k];
  return d > 0 ? (angles[k + 1] - angles[k]) / d : 0;
};
// Returns the displacement of a driven wall. A leg, a part of its path with constant velocity, consists of its start
// time, the displacement at that time, and its velocity.
export const movedAt = ({ legs = [[0, 0, 0, 0, 0]] }, time) => {
  const [begin, x, y, u, v] = legs.findLast(([since]) => since <= time) ?? legs[0];
  return [x + u * (time - begin), y + v * (time - begin)];
};
// Returns the impacts of a run and the changes of contact, in order of time.
const eventsOf = ({ impacts, modes }) => {
  const events = [];
  let k = 0;
  for (const mode of modes ?? []) {
    while (k < mode.impacts) events.push(impacts[k++]);
    events.push(mode);
  }
  return [...events, ...impacts.slice(k)];
};
// Converts a time to the time in which a disc would move as far without damping. The function clockOf converts it back.
export const flownIn = ({ damping_per_s: c }, t) => (c ? -Math.expm1(-c * t) / c : t);
export const clockOf = ({ damping_per_s: c }, t) => (!c ? t : c * t < 1 ? -Math.log1p(-c * t) / c : Infinity);
const piecesOf = ({ damping_per_s: c }, t) => (c ? Math.max(1, Math.min(400, Math.ceil(16 * c * t))) : 1);
// Returns the acceleration that a table causes, in metres per second squared. stopsAfter returns the time after which
// the table stops a disc.
export function slowing({ table_deceleration_m_s2: a = 0 }, velocity) {
  const speed = Math.hypot(...velocity);
  return a && speed ? velocity.map((v) => (-a * v) / speed) : [0, 0];
}
export const stopsAfter = ({ table_deceleration_m_s2: a = 0 }, velocity) => (a ? Math.hypot(...velocity) / a : Infinity);
// Returns the tracks of a run. Between events, discs fly freely or are in lasting contact.
export const tracksOf = (scene, run) => {
  const pullOf = (i, velocity) =>
      scene.discs[i].mass_kg === "inf" ? [0, 0] : (scene.gravity_m_s2 ?? [0, 0]).map((g, k) => g + slowing(scene, velocity)[k]);
  const velocities = scene.discs.map((d) => d.velocity_m_s ?? [0, 0]),
    now = scene.discs.map((_, i) => pullOf(i, velocities[i])),
    tracks = scene.discs.map((d, i) => [[0], [d.position_m[0]], [d.position_m[1]], [now[i]]]);
  const put = (i, ...knot) => knot.forEach((value, k) => tracks[i][k].push(value));
  const add = (i, t, [x, y]) => {
    const [begin, fromX, fromY] = tracks[i].map((values) => values.at(-1)),
      lasts = t - begin,
      pieces = piecesOf(scene, lasts);
    for (let k = 1; k < pieces; k++) {
      const passed = (lasts * k) / pieces,
        part = flownIn(scene, passed) / flownIn(scene, lasts);
      put(i, begin + passed, fromX + part * (x - fromX), fromY + part * (y - fromY), now[i]);
    }
    put(i, t, x, y, now[i]);
  };
  // On a table, a disc may have stopped before time t.
  const stopBefore = (i, t, [x, y]) => {
    const stop = tracks[i][0].at(-1) + stopsAfter(scene, velocities[i]);
    if (!(stop < t) || scene.discs[i].mass_kg === "inf") return;
    velocities[i] = now[i] = [0, 0];
    put(i, stop, x, y, now[i]);
  };
  for (const event of eventsOf(run))
    if (event.acceleration) {
      now[event.disc] = event.acceleration;
      add(event.disc, event.time_s, event.at);
    } else {
      [event.first, event.second].forEach((i, k) => {
        if (i < 0) return;
        stopBefore(i, event.time_s, event.at[k]);
        if (scene.table_deceleration_m_s2) {
          velocities[i] = event.after[k];
          now[i] = pullOf(i, velocities[i]);
        }
        add(i, event.time_s, event.at[k]);
      });
    }
  run.positions.forEach((p, i) => {
    stopBefore(i, run.end_s, p);
    add(i, run.end_s, p);
  });
  return run.modes || scene.table_deceleration_m_s2 ? tracks : tracks.map((track) => track.slice(0, 3));
};
const PIECES_OF_A_SLIDE = 12; // number of pieces for a spin that changes at a constant rate
// Returns the times and angles of each disc, for a run with spins.
export const anglesOf = (scene, run) => {
  const turned = scene.discs.map((d) => ({ times: [0], angles: [0], spin: d.spin_rad_s ?? 0, rate: 0 }));
  const add = (one, t, spin, rate = one.rate) => {
    const since = one.times.at(-1),
      angle = one.angles.at(-1),
      pieces = one.rate ? PIECES_OF_A_SLIDE : piecesOf(scene, t - since);
    for (let k = 1; k <= pieces; k++) {
      const passed = ((t - since) * k) / pieces;
      one.angles.push(angle + one.spin * flownIn(scene, passed) + 0.5 * one.rate * passed * passed);
      one.times.push(since + passed);
    }
    Object.assign(one, { spin, rate });
  };
  for (const event of eventsOf(run))
    if (event.acceleration) add(turned[event.disc], event.time_s, event.spin, event.spin_rate);
    else if (event.spins) {
      add(turned[event.first], event.time_s, event.spins[2]);
      if (event.second >= 0) add(turned[event.second], event.time_s, event.spins[3]);
    }
  for (const one of turned) add(one, Math.max(run.end_s, one.times.at(-1)), one.spin);
  return turned.map(({ times, angles }) => [times, angles]);
};
// Returns how long two discs would overlap if they flew on without their impact. The two discs would approach in the
// first half of the overlap.
export const overlapOf = (scene, impact) => {
  if (impact.second < 0) return Infinity;
  const [v, w] = impact.before,
    ux = w[0] - v[0],
    uy = w[1] - v[1],
    speed = Math.hypot(ux, uy),
    reach = scene.discs[impact.first].radius_m + scene.discs[impact.second].radius_m;
  return (2 * Math.abs(impact.normal[0] * ux + impact.normal[1] * uy) * reach) / (speed * speed);
};

export class Stage {
  constructor(label) {
    this.canvas = make("canvas", { role: "img", "aria-label": label });
    this.flat = 0.3;
    this.tall = 0.66;
    this.least = 150; // smallest height for flat scenes, in pixels
    this.shortest = 170; // smallest height in low windows, in pixels
  }
  fit(box, most = 0.62) {
    this.box = box;
    const [l, b, r, t] = box,
      width = this.canvas.clientWidth || 480,
      dense = (this.dense = window.devicePixelRatio || 1);
    const height = Math.round(
      Math.min(
        Math.max(width * Math.min(this.tall, Math.max(this.flat, (t - b) / (r - l))), this.least),
        Math.max(innerHeight * most, this.shortest),
      ),
    );
    this.canvas.style.height = `${height}px`;
    this.canvas.width = Math.round(width * dense);
    this.canvas.height = Math.round(height * dense);
    this.view(box);
    this.pen = this.canvas.getContext("2d");
    const style = getComputedStyle(document.documentElement);
    this.colour = (n) => style.getPropertyValue(n).trim();
  }
  view([l, b, r, t], [x, y, w, h] = [0, 0, this.canvas.width, this.canvas.height]) {
    this.scale = Math.min(w / (r - l), h / (t - b));
    this.origin = [x + (w - this.scale * (l + r)) / 2, y + (h + this.scale * (b + t)) / 2];
  }
  at([x, y]) {
    return [this.origin[0] + this.scale * x, this.origin[1] - this.scale * y];
  }
  metres(event) {
    const r = this.canvas.getBoundingClientRect(),
      x = (event.clientX - r.left) * this.dense,
      y = (event.clientY - r.top) * this.dense;
    return [(x - this.origin[0]) / this.scale, (this.origin[1] - y) / this.scale];
  }
  clear() {
    this.pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
  }
  hue(scene, i) {
    return scene.discs[i].mass_kg === "inf" ? this.colour("--wall") : this.colour(`--s${i % 8}`);
  }
  // Draws walls. Driven walls are drawn at their positions at the time `time`.
  walls(list, time = 0) {
    const { pen, dense } = this,
      far = this.canvas.width + this.canvas.height;
    pen.strokeStyle = this.colour("--wall");
    for (const wall of list) {
      const { point_m, normal, line, half_width } = wall,
        moved = movedAt(wall, time),
        at = ([x, y]) => this.at([x + moved[0], y + moved[1]]);
      if (line) {
        pen.lineWidth = Math.max(1.5 * dense, 2 * half_width * this.scale);
        pen.lineCap = pen.lineJoin = "round";
        pen.beginPath();
        for (const point of line) pen.lineTo(...at(point));
        pen.stroke();
        pen.lineCap = "butt";
        continue;
      }
      const [nx, ny] = normal,
        [x, y] = at(point_m),
        ax = ny,
        ay = nx;
      pen.lineWidth = 1.5 * dense;
      pen.beginPath();
      pen.moveTo(x - far * ax, y - far * ay);
      pen.lineTo(x + far * ax, y + far * ay);
      pen.stroke();
      pen.lineWidth = 0.6 * dense;
      pen.beginPath();
      for (let s = -far; s < far; s += 9 * dense) {
        const hx = x + s * ax,
          hy = y + s * ay;
        pen.moveTo(hx, hy);
        pen.lineTo(hx - 7 * dense * nx + 4 * dense * ax, hy + 7 * dense * ny + 4 * dense * ay);
      }
      pen.stroke();
    }
  }
  path(track, pull, colour, from, to, { dash = [], width = 1.6, alpha = 0.8 } = {}) {
    if (!(to > from)) return;
    const { pen, dense } = this,
      times = track[0];
    pen.strokeStyle = colour;
    pen.globalAlpha = alpha;
    pen.lineWidth = width * dense;
    pen.setLineDash(dash.map((d) => d * dense));
    pen.beginPath();
    pen.moveTo(...this.at(placeAt(track, pull, from)));
    const curved = track[3] || pull[0] || pull[1],
      last = flightAt(times, to);
    for (let k = flightAt(times, from); k <= last; k++) {
      const b = Math.max(from, times[k]),
        e = Math.min(to, times[Math.min(k + 1, times.length - 1)]),
        pieces = curved ? 16 : 1;
      for (let j = 1; j <= pieces; j++)
        pen.lineTo(...this.at(placeAt(track, pull, b + ((e - b) * j) / pieces - (j === pieces ? (e - b) * 1e-9 : 0))));
    }
    pen.stroke();
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  }
  ring(place, radius, colour, { dash = [], width = 1.5, alpha = 1, fill = null } = {}) {
    const { pen, dense } = this,
      [x, y] = this.at(place);
    pen.beginPath();
    pen.arc(x, y, Math.max(radius * this.scale, 2 * dense), 0, 2 * Math.PI);
    pen.globalAlpha = alpha;
    if (fill) {
      pen.fillStyle = fill;
      pen.fill();
    }
    pen.strokeStyle = colour;
    pen.lineWidth = width * dense;
    pen.setLineDash(dash.map((d) => d * dense));
    if (width) pen.stroke();
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  }
  disc(place, radius, colour, name, angle) {
    const { pen, dense } = this;
    this.ring(place, radius, colour, { fill: colour, alpha: 0.85 });
    const r = radius * this.scale,
      [x, y] = this.at(place);
    if (angle !== undefined) {
      // two light quarters show the rotation, and leave the disc's number readable
      pen.fillStyle = this.colour("--surface");
      pen.globalAlpha = 0.45;
      for (const a of [0, Math.PI]) {
        pen.beginPath();
        pen.moveTo(x, y);
        pen.arc(x, y, r * 0.94, -angle - a - Math.PI / 4, -angle - a + Math.PI / 4);
        pen.fill();
      }
      pen.globalAlpha = 1;
    }
    if (name !== undefined && r > 8 * dense) {
      pen.fillStyle = angle === undefined ? this.colour("--surface") : this.colour("--ink");
      pen.font = `600 ${Math.min(13, r / dense) * dense}px sans-serif`;
      pen.textAlign = "center";
      pen.textBaseline = "middle";
      pen.fillText(name, x, y);
    }
  }
  cross(place, size = 8, colour = this.colour("--wrong")) {
    const { pen, dense } = this,
      [x, y] = this.at(place),
      s = size * dense;
    pen.strokeStyle = colour;
    pen.lineWidth = 3 * dense;
    pen.lineCap = "round";
    pen.beginPath();
    pen.moveTo(x - s, y - s);
    pen.lineTo(x + s, y + s);
    pen.moveTo(x + s, y - s);
    pen.lineTo(x - s, y + s);
    pen.stroke();
    pen.lineCap = "butt";
  }
  // Draws a label and a line to its point. Twelve positions around the point are tried. The label is drawn at the first
  // position at which it covers no disc and no other label.
  label(place, text, colour, taken, bold = true) {
    const { pen, dense } = this,
      [x, y] = this.at(place);
    pen.font = `${bold ? 600 : 400} ${12 * dense}px sans-serif`;
    const w = pen.measureText(text).width + 10 * dense,
      h = 18 * dense;
    for (let away = 26; away <= 150; away += 22)
      for (let k = 0; k < 12; k++) {
        const a = -Math.PI / 2 + ((k % 2 ? -1 : 1) * Math.ceil(k / 2) * Math.PI) / 6,
          cx = x + away * dense * Math.cos(a),
          cy = y + away * dense * Math.sin(a),
          box = [cx + (Math.cos(a) < -0.1 ? -w : Math.cos(a) > 0.1 ? 0 : -w / 2), cy - h / 2, w, h];
        if (box[0] < 2 || box[1] < 2 || box[0] + w > this.canvas.width - 2 || box[1] + h > this.canvas.height - 2)
          continue;
        if (
          taken.some(([tx, ty, tw, th]) => box[0] < tx + tw && tx < box[0] + w && box[1] < ty + th && ty < box[1] + h)
        )
          continue;
        taken.push(box);
        pen.strokeStyle = colour;
        pen.lineWidth = dense;
        pen.beginPath();
        pen.moveTo(x, y);
        pen.lineTo(Math.min(Math.max(x, box[0]), box[0] + w), Math.min(Math.max(y, box[1]), box[1] + h));
        pen.stroke();
        pen.fillStyle = this.colour("--surface");
        pen.globalAlpha = 0.9;
        pen.fillRect(...box);
        pen.globalAlpha = 1;
        pen.strokeRect(...box);
        pen.fillStyle = colour;
        pen.textAlign = "left";
        pen.textBaseline = "middle";
        pen.fillText(text, box[0] + 5 * dense, box[1] + h / 2);
        return true;
      }
    return false;
  }
  square(place, radius) {
    const [x, y] = this.at(place),
      r = radius * this.scale;
    return [x - r, y - r, 2 * r, 2 * r];
  }
  arrow(from, to, colour) {
    const { pen, dense } = this,
      [x, y] = this.at(from),
      [u, v] = this.at(to),
      a = Math.atan2(v - y, u - x);
    pen.strokeStyle = pen.fillStyle = colour;
    pen.lineWidth = 2 * dense;
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(u, v);
    pen.stroke();
    pen.beginPath();
    pen.moveTo(u + 4 * dense * Math.cos(a), v + 4 * dense * Math.sin(a));
    for (const s of [2.6, -2.6]) pen.lineTo(u + 9 * dense * Math.cos(a + s), v + 9 * dense * Math.sin(a + s));
    pen.fill();
  }
}
