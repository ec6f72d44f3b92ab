// What the page shows: one scene, one method and what each makes of it; and who is told when something changes.
export const MOST_IMPACTS = 5000; // of the exact run: what is beyond is said to be cut
export const GALLERY = JSON.parse(globalThis.caromText(document.getElementById("scenes")));
const SLOWEST = 5,
  FASTEST = 1000; // frames a second of the slider and the chart
export const rateAt = (v) => Math.round(10 * SLOWEST * (FASTEST / SLOWEST) ** v) / 10;
export const placeOf = (rate) => Math.log(rate / SLOWEST) / Math.log(FASTEST / SLOWEST);
const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
export const state = {
  scene: null,
  method: "pit",
  World: null,
  time: 0,
  playing: !calm,
  speed: 1 / 4,
  truth: null,
  seen: null,
  score: null,
  chart: null,
  arrow: 0.1,
  chosen: 0,
  walls: [],
  drag: null,
};

const listeners = [];
export const whenChanged = (act) => listeners.push(act);
export const changed = () => listeners.forEach((act) => act());
