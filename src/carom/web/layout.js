// Creates the controls and pictures of the page, in their order on the page. Other modules define what controls do.
import { installed } from "./engines.js";
import { Stage, make } from "./drawing.js";
import { GALLERY, changed, rateAt, state } from "./state.js";

const G = 9.81;

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
export const rate = range("frames per second", 0, 1, 0.001, (v) => {
  state.scene.frame_rate_hz = rateAt(v);
  changed();
});
export const phase = range("frame offset", 0, 0.999, 0.001, law("phase"));
export const bounce = range("restitution", 0, 1, 0.01, (v) => {
  state.scene.restitution = state.scene.wall_restitution = v;
  changed();
});
export const grip = range("friction", 0, 1, 0.01, (v) => {
  state.scene.friction = state.scene.wall_friction = v;
  changed();
});
export const damp = range("damping", 0, 2, 0.01, law("damping_per_s"));
const option = (value, text = value) => make("option", { value }, text);
export const methods = make(
  "select",
  { id: "method", "aria-label": "Method" },
  option("pit", "PIT (checks once per frame)"),
  ...installed.flatMap(({ name, label, profiles }) =>
    Object.keys(profiles).map((profile) => option(`${name}/${profile}`, `${label}, ${profile}`)),
  ),
);
export const scenes = make(
  "select",
  { id: "scene", "aria-label": "Scene" },
  option("", "your own"),
  ...Object.keys(GALLERY).map((name) => option(name)),
);
export const walls = make("input", { type: "checkbox", id: "walls" });
export const gravity = make("input", {
  type: "checkbox",
  id: "gravity",
  onchange: () => {
    state.scene.gravity_m_s2 = gravity.checked ? [0, -G] : [0, 0];
    // a scene with gravity can't have damping, and a scene without gravity can't have rolling resistance
    state.scene[gravity.checked ? "damping_per_s" : "wall_rolling_resistance"] = 0;
    changed();
  },
});
export const play = make("button", { class: "main", id: "run", type: "button" });
export const time = make("input", {
  type: "range",
  id: "time",
  min: 0,
  max: 1,
  step: "any",
  value: 0,
  "aria-label": "time",
});
export const clock = make("output");
export const slow = make(
  "select",
  { id: "speed", "aria-label": "Speed" },
  ...[
    ["1/32", 1 / 32],
    ["1/8", 1 / 8],
    ["1/4", 1 / 4],
    ["1", 1],
  ].map(([text, v]) => make("option", { value: v, selected: v === state.speed }, `${text} × real time`)),
);
export const fewer = make(
  "button",
  {
    id: "fewer",
    type: "button",
    "aria-label": "Remove a disc",
    onclick: () => {
      state.scene.discs.pop();
      changed();
    },
  },
  "− disc",
);
export const more = make(
  "button",
  {
    id: "more",
    type: "button",
    "aria-label": "Add a disc",
  },
  "+ disc",
);
export const copy = make("button", { id: "copy", type: "button" }, "copy link");
export const save = make("button", { id: "save", type: "button" }, "download as scene file");
export const numbers = make("div", { class: "numbers" });
export const says = make("div", { class: "says" }),
  sentence = make("p", { class: "sentence", id: "sentence", role: "status" }),
  problem = make("p", { class: "muted", id: "problem", role: "status" });
export const left = new Stage("Exact run: drag a disc, or select one here and press arrow keys"),
  right = new Stage("Run of the method");
export const line = make("canvas", {
  class: "line",
  role: "img",
  "aria-label": "Timeline of the first impact: overlap and frames",
});
export const chart = make("canvas", {
  class: "line",
  role: "img",
  "aria-label": "Missed impacts and velocity error against frames per second",
});
export const lineSaid = make("p", { class: "muted" }),
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
      make("figure", {}, make("figcaption", {}, "Exact (PIC), bit-identical to carom.solve_pic"), left.canvas),
      make("figure", {}, make("figcaption", {}, methods), right.canvas),
    ),
    make(
      "p",
      { class: "muted" },
      "Right picture: solid discs show the method, grey discs the exact run, dashed rings the last frame, crosses missed impacts.",
    ),
    sentence,
    line,
    lineSaid,
    make("div", { class: "controls" }, play, make("label", { class: "wide" }, "time ", time, clock), slow),
    make("div", { class: "controls" }, rate.row, phase.row, bounce.row, grip.row, damp.row),
    says,
    chart,
    chartSaid,
    problem,
    keys,
    make("details", {}, make("summary", {}, "Numbers of all discs"), numbers),
  );
