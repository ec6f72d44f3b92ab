// What the numbers are, in words: the sentence, the boxes below it, what a frame costs, the clock.
import { bouncedAt, missedShare } from "./compare.js";
import { clock, keys, methods, play, problem, says, sentence } from "./layout.js";
import { pitOf } from "./scene.js";
import { clockOf, digits, make, overlapOf } from "./stage.js";
import { state } from "./state.js";

const box = (what, value, note, mood = "") =>
  make("div", {}, make("small", {}, what), make("b", { class: mood }, value), make("small", {}, note));
const costs = box("cost per frame", "–", "measured while nothing moves");
export function tell() {
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
          `until ${digits(truth.impacts[score.right].time_s)} s; later impacts are not comparable`,
          "off",
        )
      : box(
          "impacts missed",
          `${score.missed.length} of ${truth.impacts.length}${cut ? " and more" : ""}`,
          score.invented.length ? `${score.invented.length} invented` : "none invented",
          score.missed.length ? "off" : "fine",
        ),
    box(
      "first impact found: late by",
      found ? ms(score.late) : "–",
      found
        ? `${digits(score.late / dt, 2)} of a frame${seen.stepped ? `; it reports ${ms(score.reported)}` : ""}`
        : "none is found",
      "",
    ),
    box(
      "its direction: off by",
      found ? `${digits(score.turned)}°` : "–",
      found ? `velocity off by ${digits(100 * score.velocity, 2)} % of the speed` : "",
      "",
    ),
    box(
      "PIT misses the first impact at",
      share === null ? "–" : `${digits(100 * share)} %`,
      share === null ? "closed form for two discs only" : "of all frame offsets (closed form)",
      share > 0 ? "off" : "",
    ),
    costs,
  );
  if (!first)
    sentence.textContent = score.invented.length
      ? `Nothing meets here, and ${name} invents ${score.invented.length}.`
      : "Nothing meets here.";
  else if (first.second < 0)
    sentence.textContent = `The first impact is on a wall; frames are ${ms(dt)} apart. ${verdict(name, first)}`;
  else
    sentence.textContent = `The discs overlap while approaching for ${ms(clockOf(s, overlapOf(s, first) / 2))}; frames are ${ms(dt)} apart. ${verdict(name, first)}`;
  if (seen.warning) problem.textContent = seen.warning;
}
const beside = (late) =>
  late === 0 ? "at its instant" : `${digits(Math.abs(late) * 1000)} ms ${late < 0 ? "early" : "late"}`;
function verdict(name, first) {
  const pair = state.score.found.find(([r]) => r === first);
  if (!pair) return `${name} misses it.`;
  const [late, reported] = [bouncedAt(pair[1]) - first.time_s, pair[1].time_s - first.time_s];
  if (state.method === "pit") return `${name} finds it ${beside(late)}.`;
  if (!Number.isFinite(pair[1].effective_s)) return `${name} reports it ${beside(reported)}.`;
  return `${name} bounces them ${beside(late)}, and reports it ${beside(reported)}.`;
}
// What a frame costs, here and now: of PIT the whole run repeated until a clock of tenths of a millisecond can tell.
const TOLD_WITHIN_MS = 20;
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
    } while (performance.now() - began < TOLD_WITHIN_MS);
    each = (performance.now() - began) / runs / Math.max(1, seen.frames);
  }
  costs.replaceChildren(
    make("small", {}, "cost per frame"),
    make("b", {}, `${digits(each * 1000, 2)} µs`),
    make("small", {}, "in this browser, just now"),
  );
}
export function told() {
  play.textContent = state.playing ? "pause" : "play";
  clock.textContent = `${digits(state.time, 4)} s`;
  keys.textContent = `An arrow shows the motion in ${state.arrow} s. With the left picture in focus, a number or n selects a disc (now ${state.chosen}). Arrow keys move it; with Ctrl they change its velocity, with Shift in small steps.`;
}
play.onclick = () => {
  state.playing = !state.playing;
  told();
};
