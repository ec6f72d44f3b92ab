// State of the page: the scene, the method, both runs, and the listeners for changes.
export const MOST_IMPACTS = 5000; // largest number of impacts of the exact run
export const GALLERY = JSON.parse(globalThis.caromText(document.getElementById("scenes")));
const SLOWEST = 5,
  FASTEST = 1000; // smallest and largest number of frames per second in the slider and the chart
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
