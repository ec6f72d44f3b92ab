// Lets users move discs and arrows by mouse, touch and keyboard. A touch outside of discs scrolls the page.
import { head, moved } from "./scene_edits.js";
import { left, right } from "./layout.js";
import { draw } from "./pictures.js";
import { isFixed } from "./scene.js";
import { changed, state } from "./state.js";
import { showClock } from "./page_texts.js";

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
    state.drag = grabbed(stage, event);
    if (!state.drag) return;
    state.chosen = state.drag.i;
    stage.canvas.setPointerCapture(event.pointerId);
    event.preventDefault();
    stage.canvas.focus({ preventScroll: true });
  });
  stage.canvas.addEventListener("pointermove", (event) => {
    if (!state.drag) return;
    const p = stage.metres(event),
      d = state.scene.discs[state.drag.i];
    if (state.drag.head)
      moved(
        state.drag.i,
        "velocity_m_s",
        p.map((x, k) => (x - d.position_m[k]) / state.arrow),
      );
    else
      moved(
        state.drag.i,
        "position_m",
        p.map((x, k) => x - state.drag.off[k]),
      );
  });
  for (const end of ["pointerup", "pointercancel"])
    stage.canvas.addEventListener(end, () => {
      if (state.drag) {
        state.drag = null;
        changed();
      }
    });
}
const point = ({ clientX, clientY }) => ({ clientX, clientY });
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
  showClock();
  draw();
});
