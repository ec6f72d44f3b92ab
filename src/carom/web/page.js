// Starts the page: shows the first scene, updates the page after changes, and advances the clock of the pictures.
import { falls, pic, pit } from "./run_methods.js";
import { drawChart } from "./charts.js";
import "./dragging.js";
import { extent, head, listNumbers } from "./scene_edits.js";
import { load } from "./engines.js";
import "./start_core.js";
import { bounce, clock, damp, fewer, gravity, grip, left, more, phase, problem, rate, says, scenes } from "./layout.js";
import { sentence, slow, time, walls } from "./layout.js";
import "./links.js";
import { draw, fit } from "./pictures.js";
import { MOST_DISCS, asLink, asPageScene, bare, mayBeDamped, ofLink, problemOf } from "./scene.js";
import { choose, solve } from "./solve_runs.js";
import { digits } from "./drawing.js";
import { GALLERY, changed, placeOf, state, whenChanged } from "./state.js";
import { cost, showClock, showResults } from "./page_texts.js";

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
// Returns a scene as text, or an empty text if a number of the scene is outside the page's limits.
function written(given) {
  try {
    return JSON.stringify(bare(asPageScene(given)));
  } catch {
    return "";
  }
}
let pending = 0;
whenChanged(() => {
  const s = state.scene;
  rate.set(placeOf(s.frame_rate_hz), `${s.frame_rate_hz} (${digits(1000 / s.frame_rate_hz)} ms)`);
  phase.set(s.phase, `${digits(s.phase)} of a frame`);
  bounce.set(s.restitution, digits(s.restitution));
  grip.set(s.friction, digits(s.friction));
  damp.set(s.damping_per_s, `${digits(s.damping_per_s)} /s`);
  damp.input.disabled = !mayBeDamped(s);
  walls.checked = s.walls.length > 0;
  gravity.checked = falls(s);
  fewer.disabled = s.discs.length <= 2;
  more.disabled = s.discs.length >= MOST_DISCS;
  state.chosen = Math.min(state.chosen, s.discs.length - 1);
  const own = JSON.stringify(bare(s));
  scenes.value = Object.keys(GALLERY).find((name) => written(GALLERY[name]) === own) ?? "";
  const bad = problemOf(s);
  if (bad) sentence.textContent = `The scene can't start like this: ${bad}.`;
  else
    try {
      Object.assign(state, solve());
      showResults();
    } catch (error) {
      sentence.textContent = `The scene can't run: ${error.message}.`;
      state.seen = state.score = null;
      says.replaceChildren();
    }
  listNumbers();
  showClock();
  clearTimeout(pending);
  pending = setTimeout(() => {
    const link = `#${asLink(s, state.method)}`;
    try {
      history.replaceState(null, "", link);
    } catch {
      location.hash = link;
    }
    if (!state.drag) {
      drawChart();
      cost();
    }
  }, 150);
  fit();
});
// Shows a scene of the gallery. If a number of the scene is outside the page's limits, reports it and keeps the current
// scene.
function shown(name) {
  problem.textContent = "";
  try {
    take(asPageScene(GALLERY[name]));
  } catch (error) {
    problem.textContent = `${name}: ${error.message}`;
  }
}
scenes.onchange = () => scenes.value in GALLERY && shown(scenes.value);
slow.onchange = () => {
  state.speed = Number(slow.value);
};
time.oninput = () => {
  state.playing = false;
  state.time = Number(time.value) * state.scene.duration_s;
  showClock();
  draw();
};
const first = () => Object.keys(GALLERY).some((name) => (shown(name), state.scene));
function follow() {
  const text = location.hash.slice(1);
  if (!text) return state.scene ?? first();
  try {
    const name = decodeURIComponent(text);
    if (name in GALLERY) return take(asPageScene(GALLERY[name]));
    const { scene, method } = ofLink(text);
    take(scene, method);
  } catch (error) {
    if (!state.scene) first();
    problem.textContent = `This link does not contain a valid scene: ${error.message}`;
  }
}
addEventListener("hashchange", follow);
addEventListener("resize", fit);
follow();
let before;
function tick(now) {
  if (state.playing && before !== undefined && state.truth && !state.drag) {
    state.time += ((now - before) / 1000) * state.speed;
    if (state.time > state.scene.duration_s) state.time = 0;
    clock.textContent = `${digits(state.time, 4)} s`;
    draw();
  }
  before = now;
  requestAnimationFrame(tick);
}
requestAnimationFrame(tick);
// For tests: the state, and the positions on the screen of a disc and of the tip of its arrow.
const spot = (i, where = "position_m") => {
  const r = left.canvas.getBoundingClientRect(),
    d = state.scene.discs[i],
    [x, y] = left.at(where === "head" ? head(d) : d.position_m);
  return [r.left + x / left.dense, r.top + y / left.dense];
};
globalThis.caromPage = { state, spot, load, pic, pit, ready_ms: performance.now() };
