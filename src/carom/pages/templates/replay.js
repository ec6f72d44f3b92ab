// A replay of a run beside its reference: one clock, exact paths, and what went wrong where it did.
// The page's data blocks hold all that is drawn; names reach the page as text only.
"use strict";
(() => {
  const MARKS = { missed: "✕", invented: "+", late: "▸", early: "◂", found: "•", undecided: "?", beyond: "·" };
  const WIDEST = 1.6; // an engine that throws discs away must not shrink the scene to a dot
  const FLATTEST = 0.3, TALLEST = 0.8; // of a picture, in parts of its width
  const BESIDE = 0.6, ABOVE = 0.27; // of the window's height, that pictures side by side or one above the other may take
  const LEAST_TALL = 120; // pixels
  const SECONDS_SHOWN = 6; // about so long a replay lasts at the speed that is chosen for it
  const PIECES = 16; // lines that a parabola is drawn as
  const MOST_NAMED = 12; // discs beyond which the numbers beside small ones would hide the paths
  const MOST_DOTS = 400; // frames beyond which their dots would run into a line

  const make = (name, attributes = {}, ...children) => {
    const element = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) {
      if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
      else if (value !== false) element.setAttribute(key, value === true ? "" : value);
    }
    element.append(...children);
    return element;
  };
  const digits = (value, n = 6) => (value === undefined || value === null ? "" : String(Number(value.toPrecision(n))));

  // --- Where a disc is -------------------------------------------------------------------------------------------

  // A track is [times, xs, ys]; between two of its knots the disc flies freely: see carom.pages.tracks.
  const flightAt = ([times], time) => {
    let low = 0, high = times.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle; else high = middle;
    }
    return low;
  };
  const placeOn = (track, k, pull, time) => {
    const [times, xs, ys] = track;
    const next = Math.min(k + 1, times.length - 1);
    const begin = times[k], end = times[next];
    const part = end > begin ? (time - begin) / (end - begin) : 0;
    const bulge = 0.5 * (time - begin) * (time - end);
    return [
      xs[k] * (1 - part) + xs[next] * part + bulge * pull[0],
      ys[k] * (1 - part) + ys[next] * part + bulge * pull[1],
    ];
  };
  const placeAt = (track, pull, time) => {
    const times = track[0];
    const inside = Math.min(Math.max(time, times[0]), times[times.length - 1]);
    return placeOn(track, flightAt(track, inside), pull, inside);
  };

  // The direction from a place to the nearest point of a line of many.
  const towardsLine = (line, [x, y]) => {
    let best = [0, 0], least = Infinity;
    for (let k = 0; k + 1 < line.length; k++) {
      const [[ax, ay], [bx, by]] = [line[k], line[k + 1]], [ex, ey] = [bx - ax, by - ay];
      const part = Math.min(Math.max(((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey || 1), 0), 1);
      const [dx, dy] = [ax + part * ex - x, ay + part * ey - y], away = Math.hypot(dx, dy);
      if (away < least) [best, least] = [[dx / (away || 1), dy / (away || 1)], away];
    }
    return best;
  };

  // How far a disc has turned is [times, angles]; between two of its impacts it turns evenly.
  const angleAt = ([times, angles], time) => {
    const k = Math.min(flightAt([times], time), times.length - 2), lasted = times[k + 1] - times[k];
    const part = lasted > 0 ? Math.min(Math.max((time - times[k]) / lasted, 0), 1) : 0;
    return angles[k] * (1 - part) + angles[k + 1] * part;
  };

  // --- The picture -----------------------------------------------------------------------------------------------

  const boundsOf = (tracks, discs) => {
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    tracks.forEach(([, xs, ys], disc) => {
      const radius = discs[disc][0];
      xs.forEach((x, k) => {
        box[0] = Math.min(box[0], x - radius); box[1] = Math.min(box[1], ys[k] - radius);
        box[2] = Math.max(box[2], x + radius); box[3] = Math.max(box[3], ys[k] + radius);
      });
    });
    return box;
  };
  const framed = (scene, run) => {
    const box = boundsOf(scene.reference, scene.discs), other = boundsOf(run.tracks, scene.discs);
    const spare = ((WIDEST - 1) / 2) * Math.max(box[2] - box[0], box[3] - box[1]);
    for (const k of [0, 1]) {
      box[k] = Math.max(Math.min(box[k], other[k]), box[k] - spare);
      box[k + 2] = Math.min(Math.max(box[k + 2], other[k + 2]), box[k + 2] + spare);
    }
    const margin = 0.05 * Math.max(box[2] - box[0], box[3] - box[1]);
    return [box[0] - margin, box[1] - margin, box[2] + margin, box[3] + margin];
  };

  class Picture {
    constructor(scene, box, label) {
      this.scene = scene;
      this.box = box;
      this.canvas = make("canvas", { role: "img", "aria-label": label });
    }
    fit() {
      const [left, low, right, high] = this.box;
      const width = this.canvas.clientWidth || 480;
      const wanted = width * Math.min(TALLEST, Math.max(FLATTEST, (high - low) / (right - left)));
      const height = Math.round(Math.min(wanted, Math.max(LEAST_TALL, window.innerHeight * this.most)));
      const dense = window.devicePixelRatio || 1;
      this.canvas.style.height = `${height}px`;
      this.canvas.width = Math.round(width * dense);
      this.canvas.height = Math.round(height * dense);
      this.scale = Math.min(this.canvas.width / (right - left), this.canvas.height / (high - low));
      this.origin = [
        (this.canvas.width - this.scale * (left + right)) / 2,
        (this.canvas.height + this.scale * (low + high)) / 2,
      ];
      this.dense = dense;
      Object.assign(this.canvas.dataset, { scale: this.scale, x: this.origin[0], y: this.origin[1] });
      this.pen = this.canvas.getContext("2d");
      const style = getComputedStyle(this.canvas);
      this.colour = (name) => style.getPropertyValue(name).trim() || "#888";
    }
    at([x, y]) { return [this.origin[0] + this.scale * x, this.origin[1] - this.scale * y]; }
    clear() { this.pen.clearRect(0, 0, this.canvas.width, this.canvas.height); }
    discColour(disc) { return this.scene.discs[disc][1] ? this.colour("--wall") : this.colour(`--s${disc % 8}`); }

    walls() {
      const { pen, dense } = this, far = this.canvas.width + this.canvas.height;
      pen.strokeStyle = this.colour("--wall");
      for (const wall of this.scene.walls) {
        if (wall.line) {
          pen.lineWidth = Math.max(1.5 * dense, 2 * wall.half_width * this.scale);
          pen.lineCap = pen.lineJoin = "round";
          pen.beginPath();
          for (const point of wall.line) pen.lineTo(...this.at(point));
          pen.stroke();
          continue;
        }
        const [px, py, nx, ny] = wall;
        const [x, y] = this.at([px, py]), along = [ny, nx]; // y points down on a canvas
        pen.lineWidth = 1.5 * dense;
        pen.beginPath();
        pen.moveTo(x - far * along[0], y - far * along[1]);
        pen.lineTo(x + far * along[0], y + far * along[1]);
        pen.stroke();
        pen.lineWidth = 0.7 * dense;
        pen.beginPath();
        for (let s = -far; s < far; s += 9 * dense) {
          const [hx, hy] = [x + s * along[0], y + s * along[1]], long = 7 * dense;
          pen.moveTo(hx, hy);
          pen.lineTo(hx - long * nx + long * 0.6 * along[0], hy + long * ny + long * 0.6 * along[1]);
        }
        pen.stroke();
      }
    }
    path(track, pull, disc, from, to, ahead) {
      if (!(to > from)) return;
      const { pen, dense } = this, times = track[0];
      pen.strokeStyle = this.discColour(disc);
      pen.globalAlpha = ahead ? 0.35 : 0.8;
      pen.lineWidth = (ahead ? 1 : 1.8) * dense;
      pen.setLineDash(ahead ? [3 * dense, 4 * dense] : []);
      pen.beginPath();
      pen.moveTo(...this.at(placeAt(track, pull, from)));
      const last = flightAt(track, to);
      for (let k = flightAt(track, from); k <= last; k += 1) {
        const begin = Math.max(from, times[k]), end = Math.min(to, times[Math.min(k + 1, times.length - 1)]);
        const pieces = pull[0] || pull[1] ? PIECES : 1;
        for (let j = 1; j <= pieces; j += 1) {
          pen.lineTo(...this.at(placeOn(track, k, pull, begin + ((end - begin) * j) / pieces)));
        }
      }
      pen.stroke();
      pen.setLineDash([]);
      pen.globalAlpha = 1;
    }
    dots(track, pull, disc, step, until) {
      const { pen, dense } = this, count = Math.floor(until / step + 1e-9);
      pen.fillStyle = this.discColour(disc);
      for (let k = 0; k <= count; k += 1) {
        const [x, y] = this.at(placeAt(track, pull, k * step));
        pen.fillRect(x - 1.5 * dense, y - 1.5 * dense, 3 * dense, 3 * dense);
      }
    }
    mark(place, disc, angle) {
      const { pen, dense } = this, radius = this.scene.discs[disc][0];
      const along = (part) => this.at([place[0] + part * radius * Math.cos(angle), place[1] + part * radius * Math.sin(angle)]);
      pen.strokeStyle = this.colour("--surface");
      pen.lineWidth = Math.max(2 * dense, 0.08 * radius * this.scale);
      pen.beginPath();
      pen.moveTo(...along(0.45));
      pen.lineTo(...along(0.95));
      pen.stroke();
    }
    // Others are the discs' places: a number that has no room within its disc stands away from the nearest of them.
    disc(place, disc, outline, others = []) {
      const { pen, dense } = this, [x, y] = this.at(place);
      pen.beginPath();
      pen.arc(x, y, Math.max(this.scene.discs[disc][0] * this.scale, 2 * dense), 0, 2 * Math.PI);
      pen.strokeStyle = pen.fillStyle = this.discColour(disc);
      if (!outline) { pen.globalAlpha = 0.85; pen.fill(); pen.globalAlpha = 1; }
      pen.lineWidth = 1.5 * dense;
      pen.setLineDash(outline ? [4 * dense, 3 * dense] : []);
      pen.stroke();
      pen.setLineDash([]);
      if (!outline && this.scene.discs.length > 1) {
        const radius = this.scene.discs[disc][0] * this.scale, inside = radius > 7 * dense;
        if (!inside && this.scene.discs.length > MOST_NAMED) return;
        pen.fillStyle = inside ? this.colour("--surface") : this.discColour(disc);
        pen.font = `${11 * dense}px sans-serif`;
        pen.textAlign = "center";
        pen.textBaseline = "middle";
        const from = others.filter((_, k) => k !== disc).map((one) => this.at(one))
          .reduce((near, one) => (Math.hypot(one[0] - x, one[1] - y) < Math.hypot(near[0] - x, near[1] - y) ? one : near), [Infinity, y]);
        const angle = Number.isFinite(from[0]) ? Math.atan2(y - from[1], x - from[0]) : 0, away = inside ? 0 : radius + 8 * dense;
        pen.fillText(String(disc), x + away * Math.cos(angle), y + away * Math.sin(angle));
      }
    }
    flag(place, mark, word, bad) {
      const { pen, dense } = this, [x, y] = this.at(place);
      pen.strokeStyle = pen.fillStyle = bad ? this.colour("--wrong-bar") : this.colour("--ink");
      pen.lineWidth = 2 * dense;
      pen.beginPath();
      pen.arc(x, y, 9 * dense, 0, 2 * Math.PI);
      pen.stroke();
      pen.font = `600 ${12 * dense}px sans-serif`;
      pen.textBaseline = "middle";
      pen.textAlign = "center";
      pen.fillText(mark, x, y);
      const right = x < this.canvas.width / 2;
      pen.textAlign = right ? "left" : "right";
      pen.fillText(word, x + (right ? 13 : -13) * dense, y - 11 * dense);
    }
  }

  // --- The player ------------------------------------------------------------------------------------------------

  class Player {
    constructor(scene, run, root) {
      Object.assign(this, { scene, run, time: 0, playing: false, over: false });
      this.calm = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
      this.pulls = scene.discs.map(([, fixed]) => (fixed ? [0, 0] : scene.gravity));
      this.end = scene.duration;
      const frames = Math.ceil(this.end / run.dt - 1e-9);
      this.frames = frames;
      const box = framed(scene, run), name = `${run.engine} ${run.profile}`;
      this.truth = new Picture(scene, box, `What must happen in ${scene.name}, by PIC`);
      this.seen = new Picture(scene, box, `What ${name} makes of ${scene.name}`);
      this.speeds = [1 / 64, 1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1, 2, 4, 8, 16, 32];
      const wanted = this.end / SECONDS_SHOWN;
      this.speed = this.speeds.reduce((a, b) => (Math.abs(Math.log(b / wanted)) < Math.abs(Math.log(a / wanted)) ? b : a));
      this.build(root, name);
      this.resized = new ResizeObserver(() => this.fit());
      this.resized.observe(this.truth.canvas);
      this.fit();
      if (!this.calm) this.play(true);
    }

    build(root, name) {
      const button = (label, keys, act, text) =>
        make("button", { type: "button", "aria-label": label, title: `${label} (${keys})`, onclick: act }, text);
      this.playButton = button("Play or pause", "space", () => this.play(!this.playing), "play");
      this.slider = make("input", {
        type: "range", min: 0, max: this.end, step: "any", value: 0, "aria-label": "Time in the scene",
        oninput: () => { this.play(false); this.show(Number(this.slider.value)); },
      });
      this.rate = make("select", { "aria-label": "Speed", onchange: () => { this.speed = Number(this.rate.value); } },
        ...this.speeds.map((speed) => make("option", { value: speed, selected: speed === this.speed },
          speed < 1 ? `1/${1 / speed} of real time` : speed === 1 ? "real time" : `${speed} × real time`)));
      this.both = make("input", { type: "checkbox", onchange: () => { this.over = this.both.checked; this.layout(); } });
      this.clock = make("output", { class: "clock" });
      this.line = make("canvas", { class: "timeline", role: "img", "aria-label": "Frames, and impacts along the time" });
      this.sides = make("div", { class: "views" },
        make("figure", {}, make("figcaption", {}, "What must happen, by PIC"), this.truth.canvas),
        make("figure", {}, make("figcaption", {}, `What ${name} does${this.run.sampled ? `, looking every ${digits(this.run.dt, 4)} s` : ""}`), this.seen.canvas));
      this.controls = make("div", { class: "controls" },
        this.playButton,
        button("Back to the impact before", "Shift and left", () => this.toImpact(-1), "◀◀"),
        button("One frame back", "left", () => this.toFrame(-1), "◀"),
        button("One frame on", "right", () => this.toFrame(1), "▶"),
        button("On to the next impact", "Shift and right", () => this.toImpact(1), "▶▶"),
        make("label", {}, "Speed ", this.rate),
        make("label", {}, this.both, " overlaid"),
        this.clock);
      root.append(this.sides, this.line, this.slider, this.controls);
      for (const canvas of [this.truth.canvas, this.seen.canvas, this.line]) this.scrubs(canvas);
    }

    scrubs(canvas) {
      const move = (event) => {
        if (!event.buttons && event.type !== "pointerdown") return;
        const box = canvas.getBoundingClientRect();
        this.play(false);
        this.show((this.end * (event.clientX - box.left)) / box.width);
      };
      canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); move(event); });
      canvas.addEventListener("pointermove", move);
    }

    layout() {
      this.sides.classList.toggle("over", this.over);
      this.fit();
    }
    fit() {
      const columns = getComputedStyle(this.sides).gridTemplateColumns.split(" ").length;
      for (const picture of [this.truth, this.seen]) {
        picture.most = columns > 1 || this.over ? BESIDE : ABOVE;
        picture.fit();
      }
      const dense = window.devicePixelRatio || 1;
      this.line.width = Math.round((this.line.clientWidth || 480) * dense);
      this.line.height = Math.round(46 * dense);
      this.show(this.time);
    }
    close() {
      this.playing = false;
      this.resized.disconnect();
    }

    play(on) {
      if (on && this.time >= this.end) this.time = 0;
      this.playing = on;
      this.playButton.textContent = on ? "pause" : "play";
      if (!on) return;
      let before;
      const tick = (now) => {
        if (!this.playing) return;
        const passed = before === undefined ? 0 : (now - before) / 1000;
        const next = this.time + passed * this.speed;
        if (!this.calm || Math.floor(next / this.run.dt) > Math.floor(this.time / this.run.dt)) {
          this.show(next);
          before = now;
        } else if (before === undefined) before = now;
        if (this.time >= this.end) this.play(false);
        else requestAnimationFrame(tick);
      };
      requestAnimationFrame(tick);
    }
    toFrame(by) {
      this.play(false);
      const dt = this.run.dt, near = this.time / dt;
      const frame = by > 0 ? Math.floor(near + 1e-6) + 1 : Math.ceil(near - 1e-6) - 1;
      this.show(frame * dt);
    }
    toImpact(by) {
      this.play(false);
      const times = this.run.impacts.flatMap((row) => [row.true, row.reported]).filter((time) => time !== undefined && time !== null);
      const later = times.filter((time) => (by > 0 ? time > this.time : time < this.time));
      if (later.length) this.show(by > 0 ? Math.min(...later) : Math.max(...later));
    }
    key(event) {
      if (event.ctrlKey || event.metaKey || event.altKey || ["SELECT", "TEXTAREA"].includes(event.target.tagName)) return;
      const acts = {
        " ": () => this.play(!this.playing),
        ArrowLeft: () => (event.shiftKey ? this.toImpact(-1) : this.toFrame(-1)),
        ArrowRight: () => (event.shiftKey ? this.toImpact(1) : this.toFrame(1)),
        Home: () => { this.play(false); this.show(0); },
        End: () => { this.play(false); this.show(this.end); },
        "+": () => this.faster(1),
        "-": () => this.faster(-1),
        o: () => { this.both.checked = !this.both.checked; this.over = this.both.checked; this.layout(); },
      };
      if (event.key === " " && event.target.tagName === "BUTTON") return;
      if (acts[event.key]) { acts[event.key](); event.preventDefault(); }
    }
    faster(by) {
      const k = Math.min(Math.max(this.speeds.indexOf(this.speed) + by, 0), this.speeds.length - 1);
      this.speed = this.speeds[k];
      this.rate.selectedIndex = k;
    }

    show(time) {
      this.time = Math.min(Math.max(time, 0), this.end);
      this.slider.value = this.time;
      const frame = Math.floor(this.time / this.run.dt + 1e-9);
      this.slider.setAttribute("aria-valuetext", `${digits(this.time, 4)} seconds`);
      this.clock.textContent = `${this.time.toFixed(4)} s · frame ${frame} of ${this.frames}`;
      this.line.dataset.time = this.time;
      this.draw(this.truth, this.scene.reference, this.scene.turned, this.end, false);
      this.draw(this.seen, this.run.tracks, this.run.turned, this.run.end, true);
      this.timeline();
    }
    draw(picture, tracks, turned, end, observed) {
      picture.clear();
      picture.walls();
      const now = Math.min(this.time, end), { run } = this;
      tracks.forEach((track, disc) => {
        if (this.scene.discs[disc][1]) return;
        picture.path(track, this.pulls[disc], disc, 0, now, false);
        picture.path(track, this.pulls[disc], disc, now, end, true);
        if (observed && run.sampled && this.frames <= MOST_DOTS) picture.dots(track, this.pulls[disc], disc, run.dt, now);
      });
      if (observed && run.sampled) {
        const looked = Math.min(Math.floor(now / run.dt + 1e-9) * run.dt, end);
        tracks.forEach((track, disc) => picture.disc(placeAt(track, this.pulls[disc], looked), disc, true));
      }
      if (observed && this.over) {
        this.scene.reference.forEach((track, disc) => picture.disc(placeAt(track, this.pulls[disc], this.time), disc, true));
      }
      const places = tracks.map((track, disc) => placeAt(track, this.pulls[disc], now));
      places.forEach((place, disc) => {
        picture.disc(place, disc, false, places);
        if (turned.length && !this.scene.discs[disc][1]) picture.mark(place, disc, angleAt(turned[disc], now));
      });
      this.flags(picture, tracks, observed);
    }
    flags(picture, tracks, observed) {
      const shown = this.end / 12;
      for (const row of this.run.impacts) {
        const when = observed ? row.reported ?? row.true : row.true;
        if (when === undefined || when === null || this.time < when) continue;
        const missed = row.flag === "missed", old = this.time > when + shown;
        if (old && !(observed && missed)) continue; // the cross of what was missed stays, without its word
        if (!observed && row.flag === "invented") continue;
        const source = observed && !missed ? tracks : this.scene.reference;
        const [first, second] = row.bodies;
        const a = placeAt(source[first], this.pulls[first], when);
        const radius = this.scene.discs[first][0];
        let towards;
        if (second >= 0) {
          const b = placeAt(source[second], this.pulls[second], when);
          const away = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1;
          towards = [(b[0] - a[0]) / away, (b[1] - a[1]) / away];
        } else {
          const wall = this.scene.walls[-1 - second];
          towards = wall.line ? towardsLine(wall.line, a) : [-wall[2], -wall[3]];
        }
        const place = [a[0] + radius * towards[0], a[1] + radius * towards[1]];
        if (observed) picture.flag(place, MARKS[row.flag], old ? "" : row.became, row.flag !== "found");
        else picture.flag(place, "•", "", false); // a ring: words would hide each other
      }
    }
    timeline() {
      const pen = this.line.getContext("2d"), { width, height } = this.line, dense = window.devicePixelRatio || 1;
      const style = getComputedStyle(this.line), x = (time) => (time / this.end) * (width - 2 * dense) + dense;
      const colour = (name) => style.getPropertyValue(name).trim();
      pen.clearRect(0, 0, width, height);
      pen.font = `${10 * dense}px sans-serif`;
      pen.textBaseline = "middle";
      pen.fillStyle = colour("--muted");
      if (width / this.frames > 3 * dense) {
        for (let k = 0; k <= this.frames; k += 1) pen.fillRect(x(k * this.run.dt), height / 2 - 3 * dense, dense, 6 * dense);
      } else pen.fillRect(0, height / 2, width, dense);
      pen.textAlign = "center";
      for (const row of this.run.impacts) {
        if (row.true !== undefined) {
          pen.fillStyle = colour("--ink");
          pen.fillText("▾", x(row.true), height / 2 - 9 * dense);
        }
        pen.fillStyle = row.flag === "found" ? colour("--exact-bar") : colour("--wrong-bar");
        pen.fillText(MARKS[row.flag], x(row.reported ?? row.true), height / 2 + 11 * dense);
      }
      pen.fillStyle = colour("--link");
      pen.fillRect(x(this.time) - dense, 0, 2 * dense, height);
    }
  }

  // --- A cell's evidence -----------------------------------------------------------------------------------------

  const copyable = (title, text) => {
    const area = make("textarea", { readonly: true, rows: Math.min(12, text.split("\n").length + 1), "aria-label": title });
    area.value = text;
    const copy = make("button", { type: "button", onclick: async () => {
      area.select();
      try { await navigator.clipboard.writeText(text); } catch { document.execCommand("copy"); }
      copy.textContent = "copied";
    } }, "copy");
    return make("div", { class: "copyable" }, make("h3", {}, title, " ", copy), area);
  };
  const impactTable = (run, player) => {
    const turns = run.turned.length > 0;
    const heads = ["bodies", "by PIC, s", "reported, s", "path turned, s", "velocity error", ...(turns ? ["spin error"] : []),
      "what became of it", "cause"];
    const rows = run.impacts.map((row) => make("tr", { class: row.flag === "found" ? "" : "off" },
      make("th", { scope: "row" }, make("button", { type: "button", class: "link", onclick: () => {
        player.play(false);
        player.show(row.true ?? row.reported);
      } }, row.pair)),
      ...[digits(row.true, 9), digits(row.reported, 9), digits(row.turned, 9), digits(row.velocity, 3),
        ...(turns ? [digits(row.spin, 3)] : []), `${MARKS[row.flag]} ${row.became}`, row.cause].map((text) => make("td", {}, text))));
    return make("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Impact by impact" },
      make("table", { class: "impacts" },
        make("thead", {}, make("tr", {}, ...heads.map((head) => make("th", { scope: "col" }, head)))),
        make("tbody", {}, ...rows)));
  };
  const evidence = (scene, run, player) => [
    make("ul", { class: "said" }, ...run.said.map((sentence) => make("li", {}, sentence))),
    make("h3", {}, "Impact by impact"), impactTable(run, player),
    make("details", {}, make("summary", {}, "Settings really used"),
      make("dl", {}, ...Object.entries(run.settings).flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, value)]))),
    make("details", {}, make("summary", {}, "Run it yourself"),
      ...(run.command ? [copyable("The command", run.command)] : []), copyable("The scene, as a file", scene.file)),
  ];

  // --- The window that a cell opens ------------------------------------------------------------------------------

  const blocks = () => [...document.querySelectorAll("script[data-scene]")];
  const keyOf = () => decodeURIComponent(location.hash.slice(1));
  let player = null, opened = null;

  const open = async (dialog, key) => {
    const block = blocks().find((one) => key.startsWith(`${one.dataset.scene}/`));
    if (!block) return false;
    const scene = await unpack(block.textContent);
    const run = scene.runs.find((one) => one.key === key);
    if (!run || keyOf() !== key) return false;
    if (player) player.close();
    const body = make("div", { class: "replay" });
    const others = make("select", { "aria-label": "Method", onchange: () => { location.hash = encodeURI(others.value); } },
      ...scene.runs.map((one) => make("option", { value: one.key, selected: one === run }, `${one.symbol} ${one.engine} ${one.profile}: ${one.word}`)));
    dialog.replaceChildren(
      make("div", { class: "titlebar" },
        make("h2", { id: "replay-title" }, scene.name), others,
        make("span", { class: `badge ${run.css}` }, `${run.symbol} ${run.word}`),
        make("button", { "aria-label": "Close", title: "Close (Escape)", class: "shut", onclick: () => dialog.close() }, "✕")),
      make("p", { class: "note" }, scene.description), body);
    if (!dialog.open) { opened = document.activeElement; dialog.showModal(); }
    player = new Player(scene, run, body);
    body.append(...evidence(scene, run, player));
    player.playButton.focus({ preventScroll: true }); // so that the keys are the player's
    return true;
  };
  const follow = async (dialog) => {
    const key = keyOf();
    const found = key.includes("/") && (await open(dialog, key));
    if (!found && dialog.open) dialog.close();
  };

  const start = async () => {
    const dialog = document.getElementById("replay");
    if (dialog) {
      dialog.addEventListener("close", () => {
        if (player) player.close();
        player = null;
        if (keyOf().includes("/")) history.replaceState(null, "", location.pathname + location.search);
        if (opened) opened.focus();
      });
      dialog.addEventListener("keydown", (event) => player && player.key(event));
      window.addEventListener("hashchange", () => follow(dialog));
      await follow(dialog);
    }
    const alone = document.getElementById("replay-alone"); // a page, or a notebook's cell, of one replay
    if (alone) {
      const scene = await unpack(blocks()[0].textContent), body = make("div", { class: "replay" });
      alone.append(body);
      const shown = new Player(scene, scene.runs[0], body);
      body.append(...evidence(scene, scene.runs[0], shown));
      document.addEventListener("keydown", (event) => shown.key(event));
    }
  };
  start();
})();
