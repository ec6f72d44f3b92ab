// Draws two charts: the timeline of the first impact, and the fraction of missed impacts at different frame rates.
import { compare, missedShare } from "./compare.js";
import { chart, chartSaid, left, line, lineSaid, methods } from "./layout.js";
import { problemOf } from "./scene.js";
import { runOf } from "./solve_runs.js";
import { clockOf, digits, overlapOf } from "./drawing.js";
import { placeOf, rateAt, state } from "./state.js";

// Draws the timeline of the first impact of two discs, from before their overlap to after it.
export function drawLine() {
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
    const [half, whole] = [0.5, 1].map((part) => Math.min(clockOf(s, part * overlapOf(s, r)), s.duration_s));
    pen.fillStyle = colour("--over");
    pen.fillRect(x(r.time_s), 10 * dense, (half / span) * w, h - 20 * dense);
    pen.fillStyle = colour("--over2");
    pen.fillRect(x(r.time_s + half), 10 * dense, ((whole - half) / span) * w, h - 20 * dense);
  }
  if ((w * dt) / span >= 2)
    for (let k = Math.max(0, Math.floor(from / dt - s.phase)); (k + s.phase) * dt <= from + span; k++) {
      const t = (k + s.phase) * dt,
        seen = first && t >= first.time_s && t <= first.time_s + clockOf(s, overlapOf(s, first) / 2);
      pen.fillStyle = colour(seen ? "--right" : "--ink");
      pen.fillRect(x(t) - dense, (seen ? 2 : 8) * dense, (seen ? 4 : 2) * dense, h - (seen ? 4 : 16) * dense);
    }
  if (first) {
    pen.font = `${10 * dense}px sans-serif`;
    pen.fillStyle = colour("--muted");
    const frame = (Math.ceil(from / dt - s.phase) + s.phase) * dt;
    pen.fillText("overlap", x(first.time_s), 8 * dense);
    if ((w * dt) / span >= 2) pen.fillText("frame", x(frame), h - dense);
  }
  pen.fillStyle = colour("--link");
  pen.fillRect(x(state.time) - dense, 0, 2 * dense, h);
  lineSaid.textContent = `From ${digits(from)} to ${digits(from + span)} s. Ticks: frames of PIT; a tall, thick tick finds the first impact. Dark: the discs overlap while approaching, so PIT finds them. Light: the discs overlap while separating.`;
}
const PHASES = 8,
  RATES = 48,
  SLICE_MS = 12; // longest calculation before the page handles other events
let charted = "",
  rows = {}; // for each method, lists of frames per second, missed share, and worst velocity error
export function drawChart() {
  const { scene: s, truth } = state;
  if (state.drag || !truth) return;
  const { frame_rate_hz, phase: _, ...rest } = s,
    key = JSON.stringify([state.method, state.World !== null, rest]),
    crowd = s.discs.length > 2;
  if (key !== charted && !problemOf(s)) {
    charted = key;
    rows = { pit: [], [state.method]: [] };
    const runs = Object.keys(rows).map((method) => measured(method, crowd));
    measure(key, runs);
  }
  paintChart(s, truth, frame_rate_hz, crowd);
}
function measure(key, runs) {
  if (key !== charted) return; // a newer chart has started
  if (state.drag) {
    charted = ""; // the chart is measured again after the drag
    return;
  }
  const began = performance.now();
  while (runs.length && performance.now() - began < SLICE_MS) if (runs[0].next().done) runs.shift();
  paintChart(state.scene, state.truth, state.scene.frame_rate_hz, state.scene.discs.length > 2);
  state.chart = runs.length ? null : rows;
  if (runs.length) setTimeout(measure, 0, key, runs);
}
function paintChart(s, truth, frame_rate_hz, crowd) {
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
  for (const [v, missed] of rows[state.method] ?? []) pen.fillRect(x(v) - w / 130, y(missed), w / 65, y(0) - y(missed));
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
  for (const [method, found] of Object.entries(rows))
    curve(
      found.filter(([, , e]) => e !== null).map(([v, , e]) => [v, Math.min(1, e)]),
      method === state.method ? "--link" : "--ghost",
      method === state.method ? 2 : 1,
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
  const engine = state.method === "pit" ? "" : methods.selectedOptions[0].textContent;
  chartSaid.textContent = `The chart shows ${engine || "PIT"} at different frames per second, with ${PHASES} frame offsets each. The vertical line shows your frames per second. The bars show ${crowd ? "impacts from the first miss on" : "frame offsets at which an impact is missed"}. The line shows the largest velocity error of the first impact, divided by its speed${engine ? "; the thin line is PIT's" : ""}${crowd ? "" : `. The dashed line shows ${engine ? "PIT's" : "the"} bars by formula`}.`;
}
// Yields after each run, so that the page can react to events. Phases at which a method can't run are ignored.
function* measured(method, crowd) {
  const { scene: s, truth } = state,
    own = rows[method];
  for (let k = 0; k <= RATES; k++) {
    let missed = 0,
      ran = 0,
      worst = null;
    for (let p = 0; p < PHASES; p++) {
      let score = null;
      try {
        const run = runOf(method, { ...s, frame_rate_hz: rateAt(k / RATES), phase: (p + 0.5) / PHASES }, truth);
        score = run && compare(s, truth, run);
      } catch (error) {
        if (!(error instanceof RangeError)) throw error;
      }
      if (score) {
        ran++;
        missed += crowd ? 1 - score.right / Math.max(1, truth.impacts.length) : score.missed.length > 0;
        if (score.found.length && score.found[0][0] === truth.impacts[0]) worst = Math.max(worst ?? 0, score.velocity);
      }
      yield;
    }
    if (ran) own.push([k / RATES, missed / ran, worst]);
  }
}
