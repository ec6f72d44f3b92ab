// Draws both pictures: discs, paths, the exact run in grey, the last frame, and missed impacts.
import { legsOf } from "./prescribed_motion.js";
import { head, extent, reachOf } from "./scene_edits.js";
import { chart, left, line, right, time } from "./layout.js";
import { drawChart, drawLine } from "./charts.js";
import { isFixed, outlineOf } from "./scene.js";
import { angleAt, digits, placeAt } from "./drawing.js";
import { state } from "./state.js";

const pulls = () => state.scene.discs.map((d) => (isFixed(d) ? [0, 0] : state.scene.gravity_m_s2));
// Arcs are drawn as straight parts. A whole circle has this number of straight parts.
const ARC_PARTS = 96,
  drawnLines = new WeakMap();
function linesOf(wall) {
  if (!drawnLines.has(wall)) drawnLines.set(wall, outlineOf(wall).stretches.flatMap(lineOf));
  return drawnLines.get(wall);
}
function lineOf({ edge: { a, b, bulge }, centre, radius }) {
  if (centre === null) return [a, b];
  const whole = a[0] === b[0] && a[1] === b[1],
    turn = whole ? 2 * Math.PI : 4 * Math.atan(bulge),
    parts = Math.max(1, Math.ceil((Math.abs(turn) / (2 * Math.PI)) * ARC_PARTS)),
    from = Math.atan2(a[1] - centre[1], a[0] - centre[0]);
  const at = (k) => from + (turn * k) / parts,
    rim = (angle) => [centre[0] + radius * Math.cos(angle), centre[1] + radius * Math.sin(angle)];
  return [a, ...Array.from({ length: parts - 1 }, (_, k) => rim(at(k + 1))), b];
}
const drawnWall = (wall) => ({
  ...wall,
  ...(wall.normal ? {} : { line: linesOf(wall), half_width: wall.half_width_m ?? 0 }),
  legs: legsOf(wall).map(({ begin, moved, velocity }) => [begin, ...moved, ...velocity]),
});
function bounds() {
  const { discs, walls: ws } = state.scene,
    // the picture must contain the discs at their first impact, but not all of a long wall
    met = ws.length ? (state.truth?.impacts[0]?.at ?? []) : [],
    places = [...discs.flatMap((d) => [d.position_m, head(d)]), ...met];
  const [l, b, r, t] = extent(places),
    size = Math.max(r - l, t - b, 4 * reachOf(discs)),
    m = 0.25 * size;
  const inside = ([x, y]) => [Math.max(l - m, Math.min(r + m, x)), Math.max(b - m, Math.min(t + m, y))];
  const paths = state.truth ? state.truth.tracks.flatMap(([, xs, ys]) => xs.map((x, k) => inside([x, ys[k]]))) : [];
  const near = ws.flatMap((wall) => {
    if (!wall.normal) return linesOf(wall).map(inside);
    const [[px, py], [nx, ny]] = [wall.point_m, wall.normal];
    return discs.map(({ position_m: [x, y] }) => {
      const gap = (x - px) * nx + (y - py) * ny;
      return inside([x - gap * nx, y - gap * ny]);
    });
  });
  const whole = extent([...places, ...paths, ...near]),
    edge = 1.15 * reachOf(discs);
  return [whole[0] - edge, whole[1] - edge, whole[2] + edge, whole[3] + edge];
}
export function fit() {
  const view = state.drag && left.box ? left.box : bounds();
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
  stage.walls(s.walls.map(drawnWall), now);
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
  // a smaller delay would be invisible
  if (!score.missed.length && score.late * s.frame_rate_hz > 1e-3)
    stage.label(score.found[0][1].at[0], `${digits(score.late * 1000)} ms late`, stage.colour("--wrong"), taken);
}
export function draw() {
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
