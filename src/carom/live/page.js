// The page: two stages, controls, what the numbers are, and the chart. State is one scene and one method.
import { falls, pic, pit } from "./index.js";
import { compare, missedShare } from "./compare.js";
import { drive, installed, load } from "./engines.js";
import { MOST_DISCS, asLink, asPageScene, asToml, bare, inRange, isFixed, ofLink, problemOf } from "./scene.js";
import { Stage, anglesOf, digits, make, overlapOf, placeAt, angleAt, tracksOf } from "./stage.js";

const MOST_IMPACTS = 5000; // of the exact run: what is beyond is said to be cut
const GALLERY = JSON.parse(document.getElementById("scenes").textContent);
const SLOWEST = 5,
  FASTEST = 1000; // frames a second of the slider and the chart
const rateAt = (v) => Math.round(10 * SLOWEST * (FASTEST / SLOWEST) ** v) / 10;
const placeOf = (rate) => Math.log(rate / SLOWEST) / Math.log(FASTEST / SLOWEST);
const G = 9.81;
const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;

const state = {
  scene: null,
  method: "pit",
  World: null,
  time: 0,
  playing: !calm,
  truth: null,
  seen: null,
  score: null,
  arrow: 0.1,
  chosen: 0,
  walls: [],
};
let drag = null;

// --- controls ---
const range = (label, min, max, step, act) => {
  const out = make("output"),
    input = make("input", {
      type: "range",
      min,
      max,
      step,
      "aria-label": label,
      oninput: () => act(Number(input.value)),
    });
  return {
    input,
    out,
    row: make("label", { class: "wide" }, label, " ", input, out),
    set(value, text) {
      input.value = value;
      out.textContent = text;
    },
  };
};
const law = (name) => (v) => {
  state.scene[name] = v;
  changed();
};
const rate = range("frames a second", 0, 1, 0.001, (v) => {
  state.scene.frame_rate_hz = rateAt(v);
  changed();
});
const phase = range("phase of the looks", 0, 0.999, 0.001, law("phase"));
const bounce = range("restitution", 0, 1, 0.01, (v) => {
  state.scene.restitution = state.scene.wall_restitution = v;
  changed();
});
const grip = range("friction", 0, 1, 0.01, (v) => {
  state.scene.friction = state.scene.wall_friction = v;
  changed();
});
const option = (value, text = value) => make("option", { value }, text);
const methods = make(
  "select",
  { id: "method", "aria-label": "Method", onchange: () => choose(methods.value) },
  option("pit", "PIT: do they overlap and approach?"),
  ...installed.flatMap(({ name, label, profiles }) =>
    Object.keys(profiles).map((profile) => option(`${name}/${profile}`, `${label}, ${profile}`)),
  ),
);
const scenes = make(
  "select",
  {
    id: "scene",
    "aria-label": "Scene",
    onchange: () => GALLERY[scenes.value] && take(asPageScene(GALLERY[scenes.value])),
  },
  option("", "your own"),
  ...Object.keys(GALLERY).map((name) => option(name)),
);
const walls = make("input", {
  type: "checkbox",
  id: "walls",
  onchange: () => {
    state.scene.walls = walls.checked ? (state.walls.length ? state.walls : boxAround()) : [];
    changed();
  },
});
const gravity = make("input", {
  type: "checkbox",
  id: "gravity",
  onchange: () => {
    state.scene.gravity_m_s2 = gravity.checked ? [0, -G] : [0, 0];
    changed();
  },
});
const play = make("button", {
  class: "main",
  id: "run",
  type: "button",
  onclick: () => {
    state.playing = !state.playing;
    told();
  },
});
const time = make("input", {
  type: "range",
  id: "time",
  min: 0,
  max: 1,
  step: "any",
  value: 0,
  "aria-label": "time",
  oninput: () => {
    state.playing = false;
    state.time = Number(time.value) * state.scene.duration_s;
    told();
    draw();
  },
});
const clock = make("output");
const slow = make(
  "select",
  { id: "speed", "aria-label": "Speed" },
  ...[
    ["1/32", 1 / 32],
    ["1/8", 1 / 8],
    ["1/4", 1 / 4],
    ["1", 1],
  ].map(([text, v]) => make("option", { value: v, selected: v === 1 / 4 }, `${text} × real time`)),
);
const fewer = make(
  "button",
  {
    id: "fewer",
    type: "button",
    "aria-label": "One disc fewer",
    onclick: () => {
      state.scene.discs.pop();
      changed();
    },
  },
  "− disc",
);
const more = make(
  "button",
  {
    id: "more",
    type: "button",
    "aria-label": "One disc more",
    onclick: () => {
      addDisc();
      changed();
    },
  },
  "+ disc",
);
const copy = make("button", { id: "copy", type: "button", onclick: copyLink }, "copy link");
const save = make("button", { id: "save", type: "button", onclick: download }, "download as scene file");
const numbers = make("div", { class: "numbers" });
const says = make("div", { class: "says" }),
  sentence = make("p", { class: "sentence", id: "sentence", role: "status" }),
  problem = make("p", { class: "muted", id: "problem", role: "status" });
const left = new Stage("The exact run: drag a disc, or focus here and press arrow keys"),
  right = new Stage("What the method makes of it");
const line = make("canvas", {
  class: "line",
  role: "img",
  "aria-label": "Time about the first impact: overlap, and looks",
});
const chart = make("canvas", {
  class: "line",
  role: "img",
  "aria-label": "Impacts missed, and the velocity error, by frames a second",
});
const lineSaid = make("p", { class: "muted" }),
  chartSaid = make("p", { class: "muted" }),
  keys = make("p", { class: "muted" });
document
  .getElementById("play")
  .append(
    make(
      "div",
      { class: "controls" },
      make("label", {}, "scene ", scenes),
      fewer,
      more,
      make("label", {}, walls, "walls"),
      make("label", {}, gravity, "gravity"),
      copy,
      save,
    ),
    make(
      "div",
      { class: "views" },
      make("figure", {}, make("figcaption", {}, "Exact: PIC, with the bits of carom.solve_pic"), left.canvas),
      make("figure", {}, make("figcaption", {}, methods), right.canvas),
    ),
    make(
      "p",
      { class: "muted" },
      "Right: solid, the method; grey, the exact run; dashed ring, the last look; cross, an impact missed.",
    ),
    sentence,
    line,
    lineSaid,
    make("div", { class: "controls" }, play, make("label", { class: "wide" }, "time ", time, clock), slow),
    make("div", { class: "controls" }, rate.row, phase.row, bounce.row, grip.row),
    says,
    chart,
    chartSaid,
    problem,
    keys,
    make("details", {}, make("summary", {}, "All numbers of the discs"), numbers),
  );

// --- the scene ---
function take(scene, method) {
  state.scene = scene;
  state.walls = scene.walls;
  state.time = 0;
  state.chosen = 0;
  const fastest = Math.max(...scene.discs.map((d) => Math.hypot(...d.velocity_m_s)), 1e-9),
    size = extent(scene.discs.map((d) => d.position_m));
  const seconds = (0.15 * Math.max(size[2] - size[0], size[3] - size[1], 4 * scene.discs[0].radius_m)) / fastest;
  state.arrow = Number(Math.min(seconds, scene.duration_s).toPrecision(1));
  if (method && method !== state.method && [...methods.options].some((o) => o.value === method)) choose(method);
  else changed();
}
const extent = (places) =>
  places.reduce(
    ([l, b, r, t], [x, y]) => [Math.min(l, x), Math.min(b, y), Math.max(r, x), Math.max(t, y)],
    [Infinity, Infinity, -Infinity, -Infinity],
  );
const head = (d) => d.position_m.map((x, k) => x + state.arrow * d.velocity_m_s[k]);
const reachOf = (discs) => Math.max(...discs.map((d) => d.radius_m));
function boxAround() {
  const { discs } = state.scene,
    [l, b, r, t] = extent(discs.map((d) => d.position_m)),
    m = 2 * reachOf(discs);
  return [
    [
      [l - m, 0],
      [1, 0],
    ],
    [
      [r + m, 0],
      [-1, 0],
    ],
    [
      [0, b - m],
      [0, 1],
    ],
    [
      [0, t + m],
      [0, -1],
    ],
  ].map(([point_m, normal]) => ({ point_m, normal }));
}
function addDisc() {
  const { discs } = state.scene,
    last = discs.at(-1),
    [l, b, r, t] = left.box,
    pitch = 1.1 * last.radius_m;
  for (let y = t - 2 * pitch; y > b + pitch; y -= pitch)
    for (let x = l + 2 * pitch; x < r - pitch; x += pitch) {
      const one = { ...structuredClone(last), position_m: [x, y] };
      if (!problemOf({ ...state.scene, discs: [...discs, one] })) return discs.push(one);
    }
  problem.textContent = "There is no room for another disc.";
}
const FIELDS = [
  ["x", "position", "position_m", 0],
  ["y", "position", "position_m", 1],
  ["velocity x", "speed", "velocity_m_s", 0],
  ["velocity y", "speed", "velocity_m_s", 1],
  ["radius", "radius", "radius_m"],
  ["mass", "mass", "mass_kg"],
  ["spin", "spin", "spin_rad_s"],
];
function set(i, [, kind, field, axis], value) {
  const disc = state.scene.discs[i],
    before = disc[field];
  if (!inRange(kind, value)) return changed();
  disc[field] = axis === undefined ? value : disc[field].map((x, k) => (k === axis ? value : x));
  if (problemOf(state.scene)) disc[field] = before;
  changed();
}
function listNumbers() {
  if (
    numbers.contains(document.activeElement) &&
    numbers.querySelectorAll("tbody tr").length === state.scene.discs.length
  ) {
    for (const input of numbers.querySelectorAll("input"))
      if (input !== document.activeElement) input.value = input.read();
    return;
  }
  const row = (disc, i) =>
    make(
      "tr",
      {},
      make("th", { scope: "row" }, `disc ${i}`),
      ...FIELDS.map((field) => {
        const read = () => {
          const v = state.scene.discs[i][field[2]];
          return field[3] === undefined ? v : v[field[3]];
        };
        const fixed = isFixed(disc) && !["position", "radius"].includes(field[1]);
        const input = make("input", {
          type: "number",
          step: "any",
          value: read(),
          disabled: fixed,
          "aria-label": `disc ${i}, ${field[0]}`,
          onchange: () => set(i, field, Number(input.value)),
        });
        input.read = read;
        return make("td", {}, input);
      }),
    );
  const headings = ["", "x, m", "y, m", "vx, m/s", "vy, m/s", "radius, m", "mass, kg", "spin, rad/s"];
  numbers.replaceChildren(
    make(
      "table",
      {},
      make("thead", {}, make("tr", {}, ...headings.map((text) => make("th", { scope: "col" }, text)))),
      make("tbody", {}, ...state.scene.discs.map(row)),
    ),
  );
}

// --- solving ---
async function choose(method) {
  state.method = methods.value = method;
  state.World = null;
  problem.textContent = "";
  if (method !== "pit")
    try {
      const World = await load(method.split("/")[0]);
      if (state.method !== method) return;
      state.World = World;
    } catch (error) {
      problem.textContent = `This engine does not run here: ${error.message ?? error}`;
      state.method = methods.value = "pit";
    }
  changed();
}
function methodRun(s, truth) {
  if (state.method === "pit") {
    const run = pit(bare(s), s.frame_rate_hz, s.phase);
    return { ...run, tracks: tracksOf(s, run), angles: run.spins && anglesOf(s, run) };
  }
  if (!state.World) return null;
  const [name, profile] = state.method.split("/"),
    early = s.phase / s.frame_rate_hz;
  if (early > 0 && truth.impacts.length && early >= truth.impacts[0].time_s)
    throw new RangeError(
      "an engine begins after the phase, and the first impact lies before that: a smaller phase, please",
    );
  const { label, lacks } = installed.find((one) => one.name === name);
  const needs = {
    spin: s.discs.some((d) => d.spin_rad_s !== 0),
    friction: s.friction > 0 || (s.wall_friction > 0 && s.walls.length > 0),
  };
  for (const need of lacks) if (needs[need]) throw new RangeError(`${label} has no ${need} here, and the scene has`);
  return drive(state.World, installed.find((one) => one.name === name).profiles[profile], s, s.phase);
}
function solve() {
  const s = state.scene,
    run = pic(bare(s), MOST_IMPACTS),
    truth = { ...run, tracks: tracksOf(s, run), angles: run.spins && anglesOf(s, run) };
  const seen = methodRun(s, truth);
  return { truth, seen, score: seen && compare(s, truth, seen) };
}
let pending = 0;
function changed() {
  const s = state.scene;
  rate.set(placeOf(s.frame_rate_hz), `${s.frame_rate_hz} (${digits(1000 / s.frame_rate_hz)} ms)`);
  phase.set(s.phase, `${digits(s.phase)} of a frame`);
  bounce.set(s.restitution, digits(s.restitution));
  grip.set(s.friction, digits(s.friction));
  walls.checked = s.walls.length > 0;
  gravity.checked = falls(s);
  fewer.disabled = s.discs.length <= 2;
  more.disabled = s.discs.length >= MOST_DISCS;
  state.chosen = Math.min(state.chosen, s.discs.length - 1);
  const own = JSON.stringify(bare(s));
  scenes.value = Object.keys(GALLERY).find((name) => JSON.stringify(bare(asPageScene(GALLERY[name]))) === own) ?? "";
  const bad = problemOf(s);
  if (bad) sentence.textContent = `This is no start: ${bad}.`;
  else
    try {
      Object.assign(state, solve());
      tell();
    } catch (error) {
      sentence.textContent = `Not run: ${error.message}.`;
      state.seen = state.score = null;
      says.replaceChildren();
    }
  listNumbers();
  told();
  clearTimeout(pending);
  pending = setTimeout(() => {
    const link = `#${asLink(s, state.method)}`;
    try {
      history.replaceState(null, "", link);
    } catch {
      location.hash = link;
    }
    if (!drag) {
      drawChart();
      cost();
    }
  }, 150);
  fit();
}
const box = (what, value, note, mood = "") =>
  make("div", {}, make("small", {}, what), make("b", { class: mood }, value), make("small", {}, note));
const costs = make("div");
function tell() {
  const { scene: s, truth, seen, score } = state,
    dt = 1 / s.frame_rate_hz,
    ms = (t, n) => `${digits(t * 1000, n)} ms`;
  if (!score) return;
  const share = missedShare(s, truth, dt),
    first = truth.impacts[0],
    name = state.method === "pit" ? "PIT" : methods.selectedOptions[0].textContent,
    cut = truth.outcome === "max_impacts";
  const crowd = s.discs.length > 2 && score.missed.length > 0,
    found = score.found.length > 0;
  says.replaceChildren(
    crowd
      ? box(
          "found before the first miss",
          `${score.right} of ${truth.impacts.length}`,
          `until ${digits(truth.impacts[score.right].time_s)} s; from there on it is another story`,
          "off",
        )
      : box(
          "impacts missed",
          `${score.missed.length} of ${truth.impacts.length}${cut ? " and more" : ""}`,
          score.invented.length ? `${score.invented.length} invented` : "none invented",
          score.missed.length ? "off" : "fine",
        ),
    box(
      "first one found: time late",
      found ? ms(score.late) : "–",
      found ? `${digits(score.late / dt, 2)} of a frame` : "none is found",
      "",
    ),
    box(
      "its direction off by",
      found ? `${digits(score.turned)}°` : "–",
      found ? `velocity off by ${digits(100 * score.velocity, 2)} % of the speed` : "",
      "",
    ),
    box(
      "PIT misses the first at",
      share === null ? "–" : `${digits(100 * share)} %`,
      share === null ? "closed form: of two discs alone" : "of all phases, by closed form",
      share > 0 ? "off" : "",
    ),
    costs,
  );
  if (!first)
    sentence.textContent = score.invented.length
      ? `Nothing meets here, and ${name} invents ${score.invented.length}.`
      : "Nothing meets here.";
  else if (first.second < 0)
    sentence.textContent = `The first impact is on a wall; looks are ${ms(dt)} apart. ${verdict(name, first)}`;
  else
    sentence.textContent = `They approach in overlap for ${ms(overlapOf(s, first) / 2)}; looks are ${ms(dt)} apart. ${verdict(name, first)}`;
  if (seen.warning) problem.textContent = seen.warning;
}
function verdict(name, first) {
  const pair = state.score.found.find(([r]) => r === first);
  if (!pair) return `${name} misses it.`;
  const late = pair[1].time_s - first.time_s;
  return `${name} ${state.method === "pit" ? "finds" : "reports"} it ${late === 0 ? "at its instant" : `${digits(Math.abs(late) * 1000)} ms ${late < 0 ? "early" : "late"}`}.`;
}
// What a frame costs, here and now: of PIT the whole run repeated until a clock of tenths of a millisecond can tell.
const TOLD_WITHIN_MS = 20;
function cost() {
  const { scene: s, seen } = state;
  if (!seen) return;
  let each = seen.step_ms;
  if (each === undefined) {
    let runs = 0;
    const began = performance.now();
    do {
      pit(bare(s), s.frame_rate_hz, s.phase);
      runs++;
    } while (performance.now() - began < TOLD_WITHIN_MS);
    each = (performance.now() - began) / runs / Math.max(1, seen.frames);
  }
  costs.replaceChildren(
    make("small", {}, "cost a frame"),
    make("b", {}, `${digits(each * 1000, 2)} µs`),
    make("small", {}, "in this browser, just now"),
  );
}
function told() {
  play.textContent = state.playing ? "pause" : "play";
  clock.textContent = `${digits(state.time, 4)} s`;
  keys.textContent = `An arrow is the way of ${state.arrow} s. With the left picture in focus: a number or n chooses a disc (now ${state.chosen}), arrow keys move it, with Ctrl its velocity, with Shift finely.`;
}

// --- drawing ---
const pulls = () => state.scene.discs.map((d) => (isFixed(d) ? [0, 0] : state.scene.gravity_m_s2));
function bounds() {
  const { discs, walls: ws } = state.scene,
    places = discs.flatMap((d) => [d.position_m, head(d)]);
  const [l, b, r, t] = extent(places),
    size = Math.max(r - l, t - b, 4 * reachOf(discs)),
    m = 0.25 * size;
  const inside = ([x, y]) => [Math.max(l - m, Math.min(r + m, x)), Math.max(b - m, Math.min(t + m, y))];
  const paths = state.truth ? state.truth.tracks.flatMap(([, xs, ys]) => xs.map((x, k) => inside([x, ys[k]]))) : [];
  const near = ws.flatMap(({ point_m: [px, py], normal: [nx, ny] }) =>
    discs.map(({ position_m: [x, y] }) => {
      const gap = (x - px) * nx + (y - py) * ny;
      return inside([x - gap * nx, y - gap * ny]);
    }),
  );
  const whole = extent([...places, ...paths, ...near]),
    edge = 1.15 * reachOf(discs);
  return [whole[0] - edge, whole[1] - edge, whole[2] + edge, whole[3] + edge];
}
function fit() {
  const view = drag && left.box ? left.box : bounds();
  for (const stage of [left, right]) stage.fit(view, innerWidth < 800 ? 0.34 : 0.52);
  for (const [canvas, tall] of [
    [line, 46],
    [chart, 150],
  ]) {
    const dense = devicePixelRatio || 1;
    canvas.style.height = `${tall}px`;
    canvas.width = (canvas.clientWidth || 480) * dense;
    canvas.height = tall * dense;
  }
  draw();
  drawChart();
}
function drawRun(stage, run) {
  const { scene: s, truth, score, time: now } = state,
    pull = pulls(),
    own = run.stepped ? pull.map(() => [0, 0]) : pull,
    ghost = stage.colour("--ghost");
  const place = (i) => placeAt(run.tracks[i], own[i], now),
    looked = (Math.floor(now * s.frame_rate_hz - s.phase) + s.phase) / s.frame_rate_hz;
  stage.walls(s.walls);
  s.discs.forEach((d, i) => {
    const hue = stage.hue(s, i);
    if (run !== truth) stage.path(truth.tracks[i], pull[i], ghost, 0, truth.end_s, { width: 1, alpha: 0.5 });
    stage.path(run.tracks[i], own[i], hue, 0, now);
    stage.path(run.tracks[i], own[i], hue, now, run.end_s, { dash: [3, 4], width: 1, alpha: 0.5 });
  });
  if (run !== truth)
    s.discs.forEach((d, i) => {
      stage.ring(placeAt(truth.tracks[i], pull[i], now), d.radius_m, ghost, { fill: ghost, alpha: 0.3 });
      if (looked >= 0)
        stage.ring(placeAt(run.tracks[i], own[i], looked), d.radius_m, stage.hue(s, i), { dash: [4, 3] });
    });
  s.discs.forEach((d, i) => {
    const hue = stage.hue(s, i);
    stage.ring(d.position_m, d.radius_m, hue, { alpha: 0.45, width: 1 });
    stage.disc(place(i), d.radius_m, hue, String(i), run.angles ? angleAt(run.angles[i], now) : undefined);
    if (isFixed(d)) return;
    stage.arrow(d.position_m, head(d), hue);
    stage.ring(head(d), (6 * stage.dense) / stage.scale, hue, { alpha: 0.5 });
  });
  if (stage === left && document.activeElement === left.canvas)
    stage.ring(s.discs[state.chosen].position_m, s.discs[state.chosen].radius_m, stage.colour("--link"), { width: 3 });
  if (run === truth || !score) return;
  const taken = s.discs.map((d, i) => stage.square(place(i), d.radius_m));
  for (const r of score.missed.slice(0, s.discs.length > 2 ? 1 : 6)) {
    const at = r.at[0].map((x, k) => x + s.discs[r.first].radius_m * r.normal[k]);
    stage.cross(at);
    stage.label(at, "missed", stage.colour("--wrong"), taken);
  }
  // what is late by less moves no disc that a reader could see
  if (!score.missed.length && score.late * s.frame_rate_hz > 1e-3)
    stage.label(score.found[0][1].at[0], `${digits(score.late * 1000)} ms late`, stage.colour("--wrong"), taken);
}
function draw() {
  const { scene: s, truth, seen } = state;
  if (!truth) return;
  for (const [stage, run] of [
    [left, truth],
    [right, seen],
  ]) {
    stage.clear();
    if (run && run.tracks.length === s.discs.length) drawRun(stage, run);
  }
  time.value = state.time / s.duration_s;
  drawLine();
}
// The time about the first impact of two discs, so far spread out that its overlap is seen.
function drawLine() {
  const pen = line.getContext("2d"),
    { width: w, height: h } = line,
    { scene: s, truth } = state,
    dense = devicePixelRatio || 1,
    dt = 1 / s.frame_rate_hz,
    colour = left.colour;
  const pairs = truth.impacts.filter((r) => r.second >= 0),
    first = pairs[0];
  const span = first ? Math.min(s.duration_s, Math.max(8 * dt, 6 * overlapOf(s, first))) : s.duration_s,
    from = first ? Math.max(0, Math.min(first.time_s - span / 2, s.duration_s - span)) : 0,
    x = (t) => ((t - from) / span) * w;
  pen.clearRect(0, 0, w, h);
  for (const r of pairs.slice(0, s.discs.length > 2 ? 1 : 40)) {
    const half = overlapOf(s, r) / 2;
    pen.fillStyle = colour("--over");
    pen.fillRect(x(r.time_s), 10 * dense, (half / span) * w, h - 20 * dense);
    pen.fillStyle = colour("--over2");
    pen.fillRect(x(r.time_s + half), 10 * dense, (half / span) * w, h - 20 * dense);
  }
  if ((w * dt) / span >= 2)
    for (let k = Math.max(0, Math.floor(from / dt - s.phase)); (k + s.phase) * dt <= from + span; k++) {
      const t = (k + s.phase) * dt,
        seen = first && t >= first.time_s && t <= first.time_s + overlapOf(s, first) / 2;
      pen.fillStyle = colour(seen ? "--right" : "--ink");
      pen.fillRect(x(t) - dense, (seen ? 2 : 8) * dense, (seen ? 4 : 2) * dense, h - (seen ? 4 : 16) * dense);
    }
  pen.fillStyle = colour("--link");
  pen.fillRect(x(state.time) - dense, 0, 2 * dense, h);
  lineSaid.textContent = `From ${digits(from)} to ${digits(from + span)} s. Ticks: looks of PIT, a tall thick one where it sees the first impact of two discs. Dark: its overlap while they approach, which PIT asks for; light: while they part.`;
}
let charted = "",
  rows = [];
const PHASES = 8,
  RATES = 48,
  CHART_WITHIN_MS = 400;
function drawChart() {
  const { scene: s, truth } = state;
  if (drag || !truth) return;
  const { frame_rate_hz, phase: _, ...rest } = s,
    key = JSON.stringify(rest),
    crowd = s.discs.length > 2;
  if (key !== charted && !problemOf(s)) {
    charted = key;
    rows = measured(crowd);
  }
  const pen = chart.getContext("2d"),
    { width: w, height: h } = chart,
    dense = devicePixelRatio || 1,
    colour = left.colour;
  const x = (v) => 30 * dense + v * (w - 44 * dense),
    y = (v) => h - 24 * dense - v * (h - 34 * dense);
  pen.clearRect(0, 0, w, h);
  pen.font = `${11 * dense}px sans-serif`;
  pen.strokeStyle = pen.fillStyle = colour("--muted");
  pen.lineWidth = dense;
  pen.textBaseline = "top";
  pen.textAlign = "center";
  for (const r of [5, 10, 24, 60, 120, 240, 1000]) pen.fillText(r, x(placeOf(r)), h - 18 * dense);
  pen.textAlign = "left";
  pen.textBaseline = "middle";
  for (const part of [0, 0.5, 1]) pen.fillText(`${100 * part}%`, 0, y(part));
  pen.beginPath();
  pen.moveTo(x(0), y(0));
  pen.lineTo(x(1), y(0));
  pen.stroke();
  pen.fillStyle = colour("--wrong");
  pen.globalAlpha = 0.5;
  for (const [v, missed] of rows) pen.fillRect(x(v) - w / 130, y(missed), w / 65, y(0) - y(missed));
  pen.globalAlpha = 1;
  const curve = (points, hue, width, dash = []) => {
    pen.strokeStyle = colour(hue);
    pen.lineWidth = width * dense;
    pen.setLineDash(dash.map((d) => d * dense));
    pen.beginPath();
    for (const [v, e] of points) pen.lineTo(x(v), y(e));
    pen.stroke();
    pen.setLineDash([]);
  };
  curve(
    rows.filter(([, , e]) => e !== null).map(([v, , e]) => [v, Math.min(1, e)]),
    "--link",
    2,
  );
  if (!crowd && missedShare(s, truth, 1) !== null)
    curve(
      [...Array(201).keys()].map((k) => [k / 200, missedShare(s, truth, 1 / rateAt(k / 200))]),
      "--ink",
      1,
      [4, 3],
    );
  const v = Math.min(1, Math.max(0, placeOf(frame_rate_hz)));
  curve(
    [
      [v, 1],
      [v, 0],
    ],
    "--ink",
    2,
  );
  chartSaid.textContent = `PIT by frames a second, ${PHASES} phases each; upright: yours. Bars: ${crowd ? "impacts from the first miss on" : "phases at which an impact is missed"}. Line: worst velocity error of the first impact where it is found, of its speed${crowd ? "" : "; dashed: the closed form of the bars"}.`;
}
function measured(crowd) {
  const s = state.scene,
    { truth } = state,
    began = performance.now(),
    found = [];
  for (let k = 0; k <= RATES && performance.now() - began < CHART_WITHIN_MS; k++) {
    let missed = 0,
      worst = null;
    for (let p = 0; p < PHASES; p++) {
      const score = compare(s, truth, pit(bare(s), rateAt(k / RATES), (p + 0.5) / PHASES));
      missed += crowd ? 1 - score.right / Math.max(1, truth.impacts.length) : score.missed.length > 0;
      if (score.found.length && score.found[0][0] === truth.impacts[0]) worst = Math.max(worst ?? 0, score.velocity);
    }
    found.push([k / RATES, missed / PHASES, worst]);
  }
  return found;
}

// --- dragging: a finger that begins elsewhere than on a disc scrolls the page ---
function grabbed(stage, event) {
  const p = stage.metres(event),
    near = ((event.pointerType === "touch" ? 22 : 12) * stage.dense) / stage.scale,
    { discs } = state.scene,
    away = (q) => Math.hypot(p[0] - q[0], p[1] - q[1]);
  const i = discs.findIndex(
    (d) => !isFixed(d) && away(head(d)) < near && (away(d.position_m) > d.radius_m || away(head(d)) < near / 2),
  );
  if (i >= 0) return { i, head: true };
  const j = discs.findIndex((d) => away(d.position_m) < Math.max(d.radius_m, near));
  return j < 0 ? null : { i: j, off: p.map((x, k) => x - discs[j].position_m[k]) };
}
for (const stage of [left, right]) {
  stage.canvas.addEventListener(
    "touchstart",
    (event) => {
      if (event.touches.length === 1 && grabbed(stage, { ...point(event.touches[0]), pointerType: "touch" }))
        event.preventDefault();
    },
    { passive: false },
  );
  stage.canvas.addEventListener("pointerdown", (event) => {
    drag = grabbed(stage, event);
    if (!drag) return;
    state.chosen = drag.i;
    stage.canvas.setPointerCapture(event.pointerId);
    event.preventDefault();
    stage.canvas.focus({ preventScroll: true });
  });
  stage.canvas.addEventListener("pointermove", (event) => {
    if (!drag) return;
    const p = stage.metres(event),
      d = state.scene.discs[drag.i];
    if (drag.head)
      moved(
        drag.i,
        "velocity_m_s",
        p.map((x, k) => (x - d.position_m[k]) / state.arrow),
      );
    else
      moved(
        drag.i,
        "position_m",
        p.map((x, k) => x - drag.off[k]),
      );
  });
  for (const end of ["pointerup", "pointercancel"])
    stage.canvas.addEventListener(end, () => {
      if (drag) {
        drag = null;
        changed();
      }
    });
}
const point = ({ clientX, clientY }) => ({ clientX, clientY });
function moved(i, field, value) {
  const d = state.scene.discs[i],
    before = d[field];
  if (!value.every((x) => inRange(field === "position_m" ? "position" : "speed", x))) return;
  d[field] = value;
  if (problemOf(state.scene)) d[field] = before;
  changed();
}
left.canvas.tabIndex = 0;
left.canvas.addEventListener("focus", draw);
left.canvas.addEventListener("blur", draw);
const WAYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
left.canvas.addEventListener("keydown", (event) => {
  const { discs } = state.scene,
    way = WAYS[event.key];
  if (/^\d$/.test(event.key) && Number(event.key) < discs.length) state.chosen = Number(event.key);
  else if (event.key === "n") state.chosen = (state.chosen + 1) % discs.length;
  else if (way) {
    const d = discs[state.chosen],
      step = d.radius_m / (event.shiftKey ? 50 : 5),
      field = event.ctrlKey ? "velocity_m_s" : "position_m";
    if (field === "velocity_m_s" && isFixed(d)) return;
    moved(
      state.chosen,
      field,
      d[field].map((x, k) => x + (way[k] * step) / (event.ctrlKey ? state.arrow : 1)),
    );
  } else return;
  event.preventDefault();
  told();
  draw();
});

// --- link and file ---
async function copyLink() {
  const link = location.href.split("#")[0] + `#${asLink(state.scene, state.method)}`;
  try {
    await navigator.clipboard.writeText(link);
    copy.textContent = "copied";
  } catch {
    problem.textContent = link;
  }
}
function download() {
  const url = URL.createObjectURL(new Blob([asToml(state.scene)], { type: "application/toml" }));
  make("a", { href: url, download: "scene.toml" }).click();
  setTimeout(() => URL.revokeObjectURL(url), 1000);
}
const first = () => take(asPageScene(Object.values(GALLERY)[0]));
function follow() {
  const text = location.hash.slice(1);
  if (text in GALLERY) return take(asPageScene(GALLERY[text]));
  if (!text) return state.scene ?? first();
  try {
    const { scene, method } = ofLink(text);
    take(scene, method);
  } catch (error) {
    if (!state.scene) first();
    problem.textContent = `This link is no scene of this page: ${error.message}`;
  }
}
addEventListener("hashchange", follow);
addEventListener("resize", fit);
follow();
let before;
function tick(now) {
  if (state.playing && before !== undefined && state.truth && !drag) {
    state.time += ((now - before) / 1000) * Number(slow.value);
    if (state.time > state.scene.duration_s) state.time = 0;
    clock.textContent = `${digits(state.time, 4)} s`;
    draw();
  }
  before = now;
  requestAnimationFrame(tick);
}
requestAnimationFrame(tick);
// For tests: the state, and where on the screen a disc and the head of its arrow are.
const spot = (i, where = "position_m") => {
  const r = left.canvas.getBoundingClientRect(),
    d = state.scene.discs[i],
    [x, y] = left.at(where === "head" ? head(d) : d.position_m);
  return [r.left + x / left.dense, r.top + y / left.dense];
};
globalThis.caromPage = { state, spot, load, pic, pit, ready_ms: performance.now() };
