// Changes the scene for the user: adds and removes discs, and edits the numbers of discs and walls.
import { more, left, numbers, problem, walls } from "./layout.js";
import { inRange, isFixed, problemOf } from "./scene.js";
import { make } from "./drawing.js";
import { changed, state } from "./state.js";

export const extent = (places) =>
  places.reduce(
    ([l, b, r, t], [x, y]) => [Math.min(l, x), Math.min(b, y), Math.max(r, x), Math.max(t, y)],
    [Infinity, Infinity, -Infinity, -Infinity],
  );
export const head = (d) => d.position_m.map((x, k) => x + state.arrow * d.velocity_m_s[k]);
export const reachOf = (discs) => Math.max(...discs.map((d) => d.radius_m));
walls.onchange = () => {
  state.scene.walls = walls.checked ? (state.walls.length ? state.walls : boxAround()) : [];
  changed();
};
more.onclick = () => {
  addDisc();
  changed();
};
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
export function listNumbers() {
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
  const headings = ["disc", "x, m", "y, m", "vx, m/s", "vy, m/s", "radius, m", "mass, kg", "spin, rad/s"];
  numbers.replaceChildren(
    make(
      "table",
      {},
      make("thead", {}, make("tr", {}, ...headings.map((text) => make("th", { scope: "col" }, text)))),
      make("tbody", {}, ...state.scene.discs.map(row)),
    ),
  );
}
export function moved(i, field, value) {
  const d = state.scene.discs[i],
    before = d[field];
  if (!value.every((x) => inRange(field === "position_m" ? "position" : "speed", x))) return;
  d[field] = value;
  if (problemOf(state.scene)) d[field] = before;
  changed();
}
