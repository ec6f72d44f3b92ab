// Updates the texts of the page: the sentence about the run, the boxes below it, the cost of a frame, and the clock.
import { bouncedAt, missedShare } from "./compare.js";
import { clock, keys, methods, play, problem, says, sentence } from "./layout.js";
import { pitOf } from "./scene.js";
import { clockOf, digits, make, overlapOf } from "./drawing.js";
import { state } from "./state.js";

const box = (what, value, note, mood = "") =>
  make("div", {}, make("small", {}, what), make("b", { class: mood }, value), make("small", {}, note));
const costs = box("cost per frame", "–", "measured while nothing moves");
export function showResults() {
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
          "impacts found before the first miss",
          `${score.right} of ${truth.impacts.length}`,
          `until ${digits(truth.impacts[score.right].time_s)} s; later impacts can't be compared`,
          "off",
        )
      : box(
          "impacts missed",
          `${score.missed.length} of ${truth.impacts.length}${cut ? " and more" : ""}`,
          score.invented.length ? `${score.invented.length} invented` : "none invented",
          score.missed.length ? "off" : "fine",
        ),
    box(
      "lateness of the first impact found",
      found ? ms(score.late) : "–",
      found
        ? `${digits(score.late / dt, 2)} of a frame${seen.stepped ? `; it reports ${ms(score.reported)}` : ""}`
        : "no impact is found",
      "",
    ),
    box(
      "direction error after this impact",
      found ? `${digits(score.turned)}°` : "–",
      found ? `velocity error: ${digits(100 * score.velocity, 2)} % of the speed` : "",
      "",
    ),
    box(
      "PIT misses the first impact at",
      share === null ? "–" : `${digits(100 * share)} %`,
      share === null ? "the formula is for two discs only" : "of all frame offsets (by formula)",
      share > 0 ? "off" : "",
    ),
    costs,
  );
  if (!first)
    sentence.textContent = score.invented.length
      ? `No bodies meet here, but ${name} invents ${score.invented.length} impacts.`
      : "No bodies meet here.";
  else if (first.second < 0)
    sentence.textContent = `The first impact is on a wall. Frames are ${ms(dt)} apart. ${verdict(name, first)}`;
  else
    sentence.textContent = `The discs overlap while approaching for ${ms(clockOf(s, overlapOf(s, first) / 2))}; frames are ${ms(dt)} apart. ${verdict(name, first)}`;
  if (seen.warning) problem.textContent = seen.warning;
}
const describeLateness = (late) =>
  late === 0 ? "on time" : `${digits(Math.abs(late) * 1000)} ms ${late < 0 ? "early" : "late"}`;
function verdict(name, first) {
  const pair = state.score.found.find(([r]) => r === first);
  if (!pair) return `${name} misses the impact.`;
  const [late, reported] = [bouncedAt(pair[1]) - first.time_s, pair[1].time_s - first.time_s];
  if (state.method === "pit") return `${name} finds the impact ${describeLateness(late)}.`;
  if (!Number.isFinite(pair[1].effective_s)) return `${name} reports the impact ${describeLateness(reported)}.`;
  return `${name} lets the bodies bounce ${describeLateness(late)}, and reports the impact ${describeLateness(reported)}.`;
}
// The run of PIT is repeated for this time, in milliseconds. The cost of a frame is then known although a browser's
// clock is coarse.
const MEASURED_MS = 20;
export function cost() {
  const { scene: s, seen } = state;
  if (!seen) return;
  let each = seen.step_ms;
  if (each === undefined) {
    let runs = 0;
    const began = performance.now();
    do {
      pitOf(s);
      runs++;
    } while (performance.now() - began < MEASURED_MS);
    each = (performance.now() - began) / runs / Math.max(1, seen.frames);
  }
  costs.replaceChildren(
    make("small", {}, "cost per frame"),
    make("b", {}, `${digits(each * 1000, 2)} µs`),
    make("small", {}, "in this browser, just now"),
  );
}
export function showClock() {
  play.textContent = state.playing ? "pause" : "play";
  clock.textContent = `${digits(state.time, 4)} s`;
  keys.textContent = `An arrow shows the motion in ${state.arrow} s. When the left picture has the focus, a number or n selects a disc (now ${state.chosen}). Arrow keys move the disc; with Ctrl they change its velocity. Shift makes the steps small.`;
}
play.onclick = () => {
  state.playing = !state.playing;
  showClock();
};
