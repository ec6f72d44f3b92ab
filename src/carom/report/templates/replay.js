// Replay of a run next to its reference: both at the same times, with exact paths and marks at faults.
// The page's data blocks contain everything that is drawn. Names are inserted as text only.
"use strict";
(() => {
  const MARKS = { missed: "✕", invented: "+", late: "▸", early: "◂", found: "•", undecided: "?", beyond: "·" };
  const WIDEST = 1.6; // largest size of the shown region, divided by the reference's extent: an engine may throw discs far away
  const FLATTEST = 0.3, TALLEST = 0.8; // height of a picture divided by its width
  const ACROSS = 0.54, ABOVE = 0.25; // largest height of a picture divided by the window's height, for pictures side by side or one above the other
  const LEAST_TALL = 120; // smallest height of a picture, in pixels
  const SECONDS_SHOWN = 6; // approximate duration of a replay at its initial speed
  const SLOWEST = 1 / 8, LEAD_S = 0.6, HOLD_S = 1.5; // a replay slows before the first fault and pauses there; seconds of real time
  const FLASH_S = 0.45, MOST_FLASHES = 3; // discs flash at each step of the run
  const CROWD = 4; // with more discs, only discs with a missed impact flash, because outlines would hide everything
  const MOST_LABELS = 3;
  const MOST_NAMED = 12; // with more discs, small discs have no numbers, which would hide the paths
  const MOST_TICKED = 2; // smallest distance in pixels between the marks of two steps; closer marks would merge
  const LINE = 66, STRIP = 16; // heights in pixels: of the timeline, and of its row that shows the whole run
  const MAGNIFIES = 1.4; // smallest magnification with which an inset is drawn
  const MOST_SPINS = 4; // largest number of discs whose spins are shown as numbers
  const number = (value, n = 6) => (value === undefined || value === null ? "" : String(Number(value.toPrecision(n))));

  // Returns the direction from a position to the nearest point of a polyline.
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
  const framed = (scene, ...runs) => {
    const [box, ...others] = [scene.reference, ...runs.map(({ tracks }) => tracks)].map((tracks) => boundsOf(tracks, scene.discs));
    const other = [0, 1, 2, 3].map((k) => (k < 2 ? Math.min : Math.max)(...others.map((one) => one[k])));
    const spare = ((WIDEST - 1) / 2) * Math.max(box[2] - box[0], box[3] - box[1]);
    for (const k of [0, 1]) {
      box[k] = Math.max(Math.min(box[k], other[k]), box[k] - spare);
      box[k + 2] = Math.min(Math.max(box[k + 2], other[k + 2]), box[k + 2] + spare);
    }
    const margin = 0.05 * Math.max(box[2] - box[0], box[3] - box[1]);
    return [box[0] - margin, box[1] - margin, box[2] + margin, box[3] + margin];
  };

  // --- The player ------------------------------------------------------------------------------------------------

  class Player {
    constructor(scene, run, root) {
      Object.assign(this, { scene, run, own: run, time: 0, playing: false, over: false });
      this.calm = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
      this.pulls = scene.discs.map(([, fixed]) => (fixed ? [0, 0] : scene.gravity));
      this.end = scene.duration;
      const plane = (four) => ({ point_m: four.slice(0, 2), normal: four.slice(2) });
      this.walls = scene.walls.map((wall) => (wall.line ? wall : wall.plane ? { ...wall, ...plane(wall.plane) } : plane(wall)));
      this.bodies = { discs: scene.discs.map(([radius_m, fixed]) => ({ radius_m, mass_kg: fixed ? "inf" : 1 })) };
      this.box = framed(scene, run, ...(run.sampler ? [sampledEvery(scene, run, this.end)] : []));
      const name = `${run.engine} ${run.profile}`;
      this.truth = new Stage(`Exact: ${scene.name}, by PIC`);
      this.seen = new Stage(`${name}: ${scene.name}`);
      for (const stage of [this.truth, this.seen]) Object.assign(stage, { flat: FLATTEST, tall: TALLEST, least: 0, shortest: LEAST_TALL });
      this.findFault();
      Object.assign(this, { held: 0, past: false, flashes: [] });
      this.speeds = [1 / 64, 1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1, 2, 4, 8, 16, 32];
      const wanted = this.end / SECONDS_SHOWN;
      this.speed = this.speeds.reduce((a, b) => (Math.abs(Math.log(b / wanted)) < Math.abs(Math.log(a / wanted)) ? b : a));
      this.build(root, name);
      this.resized = new ResizeObserver(() => this.fit());
      this.resized.observe(this.truth.canvas);
      this.fit();
      if (!this.calm) this.play(true);
    }

    // Sets the first fault, the instant at which the replay pauses, and the time span shown in detail.
        findFault() {
      const { run, scene, end } = this, { dt, fault } = run;
      this.fault = fault === null ? null : run.impacts[fault.row];
      const { overlap } = this.meeting(this.fault), true_s = this.fault?.true ?? this.fault?.reported;
      this.moment = fault && fault.moment;
      this.frames = Math.ceil(end / dt - 1e-9);
      this.span = Math.min(end, overlap ? Math.max(10 * dt, 6 * overlap) : 24 * dt);
      this.from = Math.max(0, Math.min((true_s ?? 0) - this.span / 2, end - this.span));
      if (this.fault) this.centre = this.meeting(this.fault).place ?? this.touching(this.fault, run.tracks, this.moment);
    }
    // Returns the contact point of an impact in the reference, and how long the bodies would overlap.
    meeting(row) {
      const found = row && row.at !== undefined ? this.scene.meetings[row.at] : null;
      return found ? { place: found.slice(0, 2), overlap: found[2] } : {};
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
      this.line = make("canvas", { class: "timeline", role: "img", "aria-label": "Above: impacts over the whole time. Below: frames and overlaps at the first fault" });
      this.holds = make("input", { type: "checkbox", checked: true });
      this.caption = make("figcaption");
      this.said = make("p", { class: "fault", role: "status" });
      this.spins = make("p", { class: "clock", hidden: !this.run.turned.length || this.scene.discs.length > MOST_SPINS });
      this.writeTexts = () => {
        this.caption.textContent = `${name}${this.run.sampled ? `, checking every ${number(this.run.dt, 4)} s` : ""}`;
        this.said.textContent = this.run.fault ? this.run.fault.said : "";
      };
      this.writeTexts();
      this.sides = make("div", { class: "views" },
        make("figure", {}, make("figcaption", {}, "Exact, by PIC"), this.truth.canvas),
        make("figure", {}, this.caption, this.seen.canvas));
      this.controls = make("div", { class: "controls" },
        this.playButton,
        button("Previous impact",  "Shift and left", () => this.toImpact(-1), "◀◀"),
        button("Previous frame",  "left", () => this.toFrame(-1), "◀"),
        button("Next frame",  "right", () => this.toFrame(1), "▶"),
        button("Next impact",  "Shift and right", () => this.toImpact(1), "▶▶"),
        make("label", {}, "Speed ", this.rate),
        make("label", {}, this.both, " overlay both"),
        ...((this.fault || this.run.sampler) && !this.calm ? [make("label", {}, this.holds, " pause at the fault")] : []),
        this.clock);
      const drag = this.scene.drag ? [make("p", {}, make("a", { href: this.scene.drag }, "Open this scene on the play page, where you can drag its discs"))] : [];
      root.append(this.sides, ...this.modes(name), this.line, this.slider, this.controls, this.spins, ...this.stepper(), this.legend(), this.said, ...drag);
      for (const canvas of [this.truth.canvas, this.seen.canvas, this.line]) this.scrubs(canvas);
    }

    // Flight, sliding, rolling and rest of discs over time: exactly, and below as the run reports it.
    modes(name) {
      const strip = (changes) => make("div", { class: "strip" }, ...changes.slice(0, -1).map(([begin, word], k) =>
        make("span", { class: word.split(" ").at(-1), style: `flex-grow:${changes[k + 1][0] - begin}` }, word)));
      const row = (who) => ([disc, changes]) => make("div", { class: "mode" }, make("span", {}, `disc ${disc}, ${who}`), strip(changes));
      const rows = [...this.scene.modes.map(row("exact")), ...this.run.modes.map(row(name))];
      return rows.length ? [make("div", { class: "modes", role: "group", "aria-label": "How discs move in contact" }, ...rows)] : [];
    }
    // Slider for PIT's step size, in a scene of two discs.
    stepper() {
      if (!this.own.sampler) return [];
      const { frame } = this.scene, written = make("output", {});
      const write = () => { written.textContent = `${number(1000 * this.run.dt, 3)} ms, ${number(this.run.dt / frame, 3)} of a frame`; };
      this.step = make("input", {
        // The smallest step is slightly above a twentieth of a frame. With a round fraction, a check may be exactly at the
        // impact.
        type: "range", min: Math.log(frame / 20) + 0.01, max: Math.log(3 * frame), step: 0.02, value: Math.log(this.own.dt), "aria-label": "Step of PIT",
        oninput: () => {
          this.play(false);
          this.run = sampledEvery(this.scene, this.own, Math.exp(Number(this.step.value)));
          this.findFault();
          this.writeTexts();
          write();
          this.show(this.moment);
        },
      });
      write();
      return [make("label", { class: "step" }, "Step of PIT ", this.step, " ", written)];
    }

    legend() {
      const drawn = (body) => {
        const holder = make("template"), name = "svg"; // the parser sets the namespace
        holder.innerHTML = `<${name} viewBox="0 0 26 16" aria-hidden="true">${body}</${name}>`;
        return holder.content.firstChild;
      };
      const frames = this.run.sampled ? [
        ["<circle cx='13' cy='8' r='6' fill='none' stroke='var(--s0)' stroke-dasharray='3 2' stroke-width='1.5'/>", "last frame"],
        ["<path d='M8 1v14M18 1v14' stroke='var(--ink)' stroke-width='2'/>", "frames"]] : [];
      const signs = [
        ["<circle cx='13' cy='8' r='6' fill='var(--s0)'/>", `position by ${this.run.engine}`],
        ["<circle cx='13' cy='8' r='6' fill='var(--ghost)' opacity='.5'/>", "exact position"],
                ...frames,
        ["<path d='M8 3l10 10M18 3L8 13' stroke='var(--wrong-bar)' stroke-width='2.5'/>", "missed impact"],
        ["<rect x='2' y='3' width='11' height='10' fill='var(--over)'/><rect x='13' y='3' width='11' height='10' fill='var(--over2)'/>",
          "time of overlap: approaching, separating"]];
      return make("div", { class: "signs" }, ...signs.map(([body, text]) => make("span", {}, drawn(body), text)));
    }

    scrubs(canvas) {
      const move = (event) => {
        if (!event.buttons && event.type !== "pointerdown") return;
        const box = canvas.getBoundingClientRect();
        this.play(false);
        const part = (event.clientX - box.left) / box.width, spread = canvas === this.line && event.clientY - box.top > STRIP;
        this.show(spread ? this.from + part * this.span : part * this.end);
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
      for (const stage of [this.truth, this.seen]) {
        stage.fit(this.box, columns > 1 || this.over ? ACROSS : ABOVE);
        Object.assign(stage.canvas.dataset, { scale: stage.scale, x: stage.origin[0], y: stage.origin[1] });
      }
      const dense = window.devicePixelRatio || 1;
      this.line.width = Math.round((this.line.clientWidth || 480) * dense);
      this.line.height = Math.round(LINE * dense);
      this.show(this.time);
    }
    close() {
      this.playing = false;
      this.resized.disconnect();
    }

    play(on) {
      if (on && this.time >= this.end) this.time = 0;
      this.playing = on;
      if (on) Object.assign(this, { held: 0, past: this.fault === null || this.time >= this.moment });
      this.flashes = [];
      this.playButton.textContent = on ? "pause" : "play";
      if (!on) return;
      let before;
      const tick = (now) => {
        if (!this.playing) return;
        const passed = before === undefined ? 0 : (now - before) / 1000;
        const next = this.calm ? this.time + passed * this.speed : this.next(passed);
        if (!this.calm || Math.floor(next / this.run.dt) > Math.floor(this.time / this.run.dt)) {
          this.flash(next, passed);
          this.show(next);
          before = now;
        } else if (before === undefined) before = now;
        if (this.time >= this.end) this.play(false);
        else requestAnimationFrame(tick);
      };
      requestAnimationFrame(tick);
    }
    // Slows before the first fault, and pauses there.
    next(passed) {
      if (this.past || !this.holds.checked) return this.time + passed * this.speed;
      if (this.time >= this.moment) {
        this.held += passed;
        this.past = this.held >= HOLD_S;
        return this.time;
      }
      const left = (this.moment - this.time) / (this.speed * LEAD_S);
      return Math.min(this.time + passed * this.speed * Math.min(1, Math.max(SLOWEST, left)), this.moment);
    }
    frameAt(time) { return Math.floor(Math.min(time, this.run.end) / this.run.dt + 1e-9); }
    flash(next, passed) {
      if (!this.run.sampled || this.calm) return;
      this.flashes = this.flashes.map(({ time, left }) => ({ time, left: left - passed })).filter(({ left }) => left > 0);
      const last = this.frameAt(next);
      for (let k = Math.max(this.frameAt(this.time), last - MOST_FLASHES) + 1; k <= last; k++) this.flashes.push({ time: k * this.run.dt, left: FLASH_S });
      this.flashes = this.flashes.slice(-MOST_FLASHES);
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
      if (event.ctrlKey || event.metaKey || event.altKey || ["SELECT", "TEXTAREA"].includes(event.target.tagName) || event.target === this.step) return;
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
      this.slider.setAttribute("aria-valuetext", `${number(this.time, 4)} seconds`);
      this.clock.textContent = `${this.time.toFixed(4)} s · frame ${frame} of ${this.frames}`;
      this.line.dataset.time = this.time;
      this.spins.textContent = this.spins.hidden ? "" : `spin, rad/s: ${this.run.turned.map((_, i) => this.spinOf(i)).join(", ")}`;
      for (const stage of [this.truth, this.seen]) {
        stage.clear();
        this.draw(stage);
      }
      this.inset();
      this.timeline();
    }

    spinOf(i) {
      const spin = (turned, end) => digits(spinAt(turned[i], Math.min(this.time, end)));
      const must = this.scene.turned.length ? ` (exact: ${spin(this.scene.turned, this.end)})` : "";
      return `disc ${i} ${spin(this.run.turned, this.run.end)}${must}`;
    }

    // Solid: discs of the run. Grey: exact positions. Dashed: positions at the run's latest step.
    draw(stage, near = false) {
      const { scene, run, pulls, bodies, end } = this, observed = stage === this.seen, { discs } = bodies;
      const tracks = observed ? run.tracks : scene.reference, turned = observed ? run.turned : scene.turned;
      const now = Math.min(this.time, observed ? run.end : end), ghost = stage.colour("--ghost");
      const moving = discs.map((_, i) => i).filter((i) => discs[i].mass_kg !== "inf");
      const ring = (i, time, how) => stage.ring(placeAt(tracks[i], pulls[i], time), discs[i].radius_m, stage.hue(bodies, i), how);
      stage.walls(this.walls, now);
      for (const i of moving) {
        stage.path(scene.reference[i], pulls[i], ghost, 0, end, { width: 1, alpha: 0.7 });
        stage.path(tracks[i], pulls[i], stage.hue(bodies, i), 0, now, { width: near ? 2.4 : 1.8 });
      }
      if (observed) {
        const sampled = discs.length > CROWD && this.fault ? moving.filter((i) => this.fault.bodies.includes(i)) : moving;
        for (const { time, left } of this.flashes) for (const i of sampled) ring(i, time, { alpha: left / FLASH_S, width: 2.5 });
        if (run.sampled) for (const i of moving) ring(i, this.frameAt(now) * run.dt, { dash: [4, 3] });
        for (const i of moving) stage.ring(placeAt(scene.reference[i], pulls[i], this.time), discs[i].radius_m, ghost, { fill: ghost, alpha: 0.4 });
      }
      const places = tracks.map((track, i) => placeAt(track, pulls[i], now));
      places.forEach((place, i) => {
        const angle = turned.length && discs[i].mass_kg !== "inf" ? angleAt(turned[i], now) : undefined;
        stage.disc(place, discs[i].radius_m, stage.hue(bodies, i), discs.length > 1 ? String(i) : undefined, angle);
      });
      const taken = places.map((place, i) => stage.square(place, discs[i].radius_m));
      if (discs.length > 1 && discs.length <= MOST_NAMED) places.forEach((_, i) => this.nameBeside(stage, places, i));
      const corner = observed && !near ? this.corner() : null;
      if (corner) taken.push([corner.x, corner.y, corner.side, corner.side]);
      this.flags(stage, tracks, taken, near);
    }
    // Writes the number of a small disc next to it, on the side away from its nearest neighbour.
    nameBeside(stage, places, i) {
      const { pen, dense } = stage, radius = this.bodies.discs[i].radius_m * stage.scale, [x, y] = stage.at(places[i]);
      if (radius > 8 * dense) return; // Stage.disc writes it
      const others = places.filter((_, k) => k !== i).map((one) => stage.at(one));
      const away = ([u, v]) => Math.hypot(u - x, v - y);
      const [u, v] = others.reduce((a, b) => (away(b) < away(a) ? b : a));
      const angle = u === x && v === y ? 0 : Math.atan2(y - v, x - u), far = radius + 8 * dense;
      pen.fillStyle = stage.hue(this.bodies, i);
      pen.font = `${11 * dense}px sans-serif`;
      pen.textAlign = "center";
      pen.textBaseline = "middle";
      pen.fillText(String(i), x + far * Math.cos(angle), y + far * Math.sin(angle));
    }
    // Returns the point at which two bodies of a run touch, as drawn.
    touching(row, tracks, when) {
      const { scene, pulls } = this, [first, second] = row.bodies, radius = scene.discs[first][0];
      const a = placeAt(tracks[first], pulls[first], when);
      let towards;
      if (second >= 0) {
        const b = placeAt(tracks[second], pulls[second], when), away = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1;
        towards = [(b[0] - a[0]) / away, (b[1] - a[1]) / away];
      } else {
        const wall = this.walls[-1 - second], moved = movedAt(wall, when), seen = a.map((x, k) => x - moved[k]);
        towards = wall.line ? towardsLine(wall.line, seen) : wall.normal.map((x) => -x);
      }
      return [a[0] + radius * towards[0], a[1] + radius * towards[1]];
    }
    flags(stage, tracks, taken, near) {
      const observed = stage === this.seen, shown = this.end / 12, wrong = stage.colour("--wrong-bar"), words = [];
      for (const row of this.run.impacts) {
        const missed = row.flag === "missed", when = observed && !missed ? row.reported ?? row.true : row.true;
        if (when === undefined || when === null || this.time < when) continue;
        const recent = this.time <= when + shown, lost = ["missed", "undecided", "beyond"].includes(row.flag);
        const { place } = this.meeting(row), here = observed && !lost ? this.touching(row, tracks, when) : place;
        if (observed && missed) stage.cross(here, near ? 11 : 7, wrong); // stays visible
        else if (recent) stage.ring(here, (9 * stage.dense) / stage.scale, observed && row.flag !== "found" ? wrong : stage.colour("--ink"), { width: 2 });
        if (observed && !near && (missed || (recent && row.flag !== "found"))) words.push([here, row]);
      }
      const who = ({ pair }) => (this.scene.discs.length > 2 ? `, ${pair}` : "");
      for (const [place, row] of words.slice(-MOST_LABELS)) stage.label(place, `${row.became}${who(row)}`, stage.colour("--wrong-ink"), taken);
    }

    // Returns the corner for the magnified inset, farthest from the fault; null if there is no inset.
    corner() {
      const { fault, seen: stage } = this, { dense, canvas, scale } = stage;
      if (!fault || Math.abs(this.time - this.moment) > Math.max(this.span / 5, this.end / 40)) return null;
      const [u, v] = stage.at(this.centre), side = Math.min(canvas.height * 0.56, canvas.width * 0.42);
      const radius = 2.5 * Math.max(...fault.bodies.filter((b) => b >= 0).map((b) => this.scene.discs[b][0]));
      if (side / (2 * radius) < MAGNIFIES * scale) return null;
      const far = (at, whole) => (at < whole / 2 ? whole - side - 8 * dense : 8 * dense);
      return { x: far(u, canvas.width), y: far(v, canvas.height), side, radius, u, v };
    }
    inset() {
      const found = this.corner(), { seen: stage, fault } = this;
      if (!found) return;
      const { x, y, side, radius, u, v } = found, { pen, dense, scale, origin } = stage, [cx, cy] = this.centre, half = radius * scale;
      pen.strokeStyle = stage.colour("--muted");
      pen.lineWidth = dense;
      pen.strokeRect(u - half, v - half, 2 * half, 2 * half);
      pen.save();
      pen.beginPath();
      pen.rect(x, y, side, side);
      pen.fillStyle = stage.colour("--surface");
      pen.fill();
      pen.clip();
      stage.view([cx - radius, cy - radius, cx + radius, cy + radius], [x, y, side, side]);
      this.draw(stage, true);
      pen.fillStyle = stage.colour("--surface");
      pen.globalAlpha = 0.85;
      pen.fillRect(x, y, side, 20 * dense);
      pen.restore();
      Object.assign(stage, { scale, origin });
      pen.strokeStyle = stage.colour("--muted");
      pen.lineWidth = 2 * dense;
      pen.strokeRect(x, y, side, side);
      pen.fillStyle = stage.colour("--wrong-ink");
      pen.font = `600 ${11 * dense}px sans-serif`;
      pen.textAlign = "left";
      pen.textBaseline = "middle";
      pen.fillText(`${fault.became}, ${number(side / (2 * radius) / scale, 2)} × larger`, x + 5 * dense, y + 10 * dense, side - 10 * dense);
    }

    // Above: the whole run. Below: the time around the first fault, with steps, and with overlaps of its two bodies.
    timeline() {
      const pen = this.line.getContext("2d"), { width: w, height: h } = this.line, dense = window.devicePixelRatio || 1;
      const { run, end, from, span, fault } = this, colour = (name) => this.seen.colour(name);
      const whole = (time) => (time / end) * (w - 2 * dense) + dense, x = (time) => ((time - from) / span) * w;
      const strip = 12 * dense, top = 22 * dense, low = h - 16 * dense;
      pen.clearRect(0, 0, w, h);
      pen.fillStyle = colour("--rule");
      pen.fillRect(0, strip, w, dense);
      pen.globalAlpha = 0.7;
      pen.beginPath();
      for (const point of [[whole(from), strip], [whole(from + span), strip], [w, top - 2 * dense], [0, top - 2 * dense]]) pen.lineTo(...point);
      pen.fill();
      pen.globalAlpha = 1;
      const rows = [...run.impacts].sort((a, b) => (a.flag !== "found") - (b.flag !== "found")); // faults are drawn on top
      for (const row of rows) {
        pen.fillStyle = colour(row.flag === "found" ? "--exact-bar" : "--wrong-bar");
        pen.fillRect(whole(row.true ?? row.reported) - dense, row.flag === "found" ? strip / 2 : 0, 2 * dense, row.flag === "found" ? strip / 2 : strip);
      }
      const same = (row) => !fault || this.scene.discs.length === 2 || row.bodies.join() === fault.bodies.join();
      const shaded = run.impacts.filter(same).map((row) => [row.true, this.meeting(row).overlap]).filter(([, overlap]) => overlap);
      for (const [begin, overlap] of shaded)
        for (const [name, part] of [["--over", 0], ["--over2", 0.5]]) {
          pen.fillStyle = colour(name);
          pen.fillRect(x(begin + part * overlap), top + 3 * dense, (overlap / 2 / span) * w, low - top - 6 * dense);
        }
      if (run.sampled && (run.dt / span) * w > MOST_TICKED * dense)
        for (let k = Math.max(0, Math.ceil(from / run.dt)); k * run.dt <= Math.min(from + span, run.end) * (1 + 1e-12); k++) {
          const time = k * run.dt;
          const falls = shaded.some(([begin, overlap]) => time >= begin && time <= begin + overlap / 2 && time < begin + run.dt); // the first step within the overlap
          pen.fillStyle = colour("--ink");
          pen.fillRect(x(time) - (falls ? 2 : 1) * dense, top + (falls ? 0 : 4 * dense), (falls ? 4 : 2) * dense, low - top - (falls ? 0 : 8 * dense));
        }
      if (fault) {
        const text = `${MARKS[fault.flag]} ${fault.became}`;
        pen.font = `600 ${11 * dense}px sans-serif`;
        pen.textAlign = "center";
        pen.textBaseline = "middle";
        pen.fillStyle = colour("--wrong-ink");
        const half = pen.measureText(text).width / 2 + 2 * dense;
        pen.fillText(text, Math.min(Math.max(x(fault.reported ?? fault.true), half), w - half), h - 7 * dense);
      }
      pen.fillStyle = colour("--link");
      pen.fillRect(whole(this.time) - dense, 0, 2 * dense, strip);
      pen.fillRect(x(this.time) - dense, top - 2 * dense, 2 * dense, low - top + 4 * dense);
    }
  }

  // --- Details of a run ------------------------------------------------------------------------------------------

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
    const heads = ["bodies", "exact time, s", "reported, s", "path turned, s", "velocity error", ...(turns ? ["spin error"] : []),
      "outcome", "cause"];
    const rows = run.impacts.map((row) => make("tr", { class: row.flag === "found" ? "" : "off" },
      make("th", { scope: "row" }, make("button", { type: "button", class: "link", onclick: () => {
        player.play(false);
        player.show(row.true ?? row.reported);
      } }, row.pair)),
      ...[number(row.true, 9), number(row.reported, 9), number(row.turned, 9), number(row.velocity, 3),
        ...(turns ? [number(row.spin, 3)] : []), `${MARKS[row.flag]} ${row.became}`, row.cause].map((text) => make("td", {}, text))));
    return make("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Impacts" },
      make("table", { class: "impacts" },
        make("thead", {}, make("tr", {}, ...heads.map((head) => make("th", { scope: "col" }, head)))),
        make("tbody", {}, ...rows)));
  };
  const evidence = (scene, run, player, heading = "h3") => {
    const said = make("ul", { class: "said" }, ...run.said.map((sentence) => make("li", {}, sentence)));
    const title = make(heading, {}, `Impacts${run.sampler ? `, with its original step of ${number(1000 * run.dt, 3)} ms` : ""}`);
    return [
      ...(run.sampler ? [title, said] : [said, title]), impactTable(run, player),
      make("details", {}, make("summary", {}, "Settings used"),
        make("dl", {}, ...Object.entries(run.settings).flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, value)]))),
      make("details", {}, make("summary", {}, "Repeat this run"),
        ...(run.command ? [copyable("Command", run.command)] : []), copyable("Scene file", scene.file),
        ...(scene.thrown && !scene.drag ? [copyable("To drag this scene, save it as scene.toml", scene.thrown)] : [])),
    ];
  };

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
    player.playButton.focus({ preventScroll: true }); // with the focus, the player receives keys
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
    const alone = document.getElementById("replay-alone"); // a page or a notebook's cell with one replay
    if (alone) {
      const scene = await unpack(blocks()[0].textContent), body = make("div", { class: "replay" });
      alone.append(body);
      const shown = new Player(scene, scene.runs[0], body);
      body.append(...evidence(scene, scene.runs[0], shown, "h2")); // below the page's own h1
      document.addEventListener("keydown", (event) => shown.key(event));
    }
  };
  start();
})();
