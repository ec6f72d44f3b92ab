// Computes the exact run, the run of the chosen method, and their comparison.
import { compare } from "./compare.js";
import { isDriven, legsOf } from "./prescribed_motion.js";
import { drive, installed, load } from "./engines.js";
import { pic } from "./run_methods.js";
import { methods, problem } from "./layout.js";
import { bare, pitOf } from "./scene.js";
import { anglesOf, tracksOf } from "./drawing.js";
import { MOST_IMPACTS, changed, state } from "./state.js";

export async function choose(method) {
  state.method = methods.value = method;
  state.World = null;
  problem.textContent = "";
  if (method !== "pit")
    try {
      const World = await load(method.split("/")[0]);
      if (state.method !== method) return;
      state.World = World;
    } catch (error) {
      problem.textContent = `This engine can't run here: ${error.message ?? error}`;
      state.method = methods.value = "pit";
    }
  changed();
}
// Runs a scene with a method, at the scene's frame rate and phase. Returns null if the method has not started yet.
export function runOf(method, s, truth) {
  if (method === "pit") return pitOf(s);
  if (!state.World) return null;
  const [name, profile] = method.split("/"),
    early = s.phase / s.frame_rate_hz;
  if (early > 0 && truth.impacts.length && early >= truth.impacts[0].time_s)
    throw new RangeError(
      "the first impact is before the frame offset, at which the engine starts: choose a smaller frame offset",
    );
  const { label, lacks, profiles } = installed.find((one) => one.name === name);
  const chains = s.walls.filter((w) => w.points_m);
  const needs = {
    "spinning discs": s.discs.some((d) => d.spin_rad_s !== 0),
    friction: s.friction > 0 || s.walls.some((w) => (w.friction ?? s.wall_friction) > 0),
    "walls of straight edges": chains.some((w) => !(w.bulges?.length && w.bulges.every((bulge) => bulge !== 0))),
    "walls of arcs or circles": s.walls.some((w) => w.centre_m) || chains.some((w) => w.bulges?.some((bulge) => bulge !== 0)),
    "walls with different restitution or friction": s.walls.some((w) => w.restitution !== undefined || w.friction !== undefined),
    "driven walls": s.walls.some((w) => isDriven(legsOf(w))),
    "driven bodies whose velocity changes": [...s.discs, ...s.walls].some((body) => body.legs?.length > 1),
    "conveyor walls": s.walls.some((w) => w.surface_speed_m_s),
    "conveyor edges or circles": s.walls.some((w) => w.surface_speed_m_s && !w.normal),
    "rolling resistance": s.wall_rolling_resistance > 0,
    "driven discs": s.discs.some((d) => d.driven),
    damping: s.damping_per_s > 0,
    "table deceleration": s.table_deceleration_m_s2 > 0,
  };
  for (const need of lacks) if (needs[need]) throw new RangeError(`${label} does not support this scene, which has ${need}`);
  return drive(state.World, profiles[profile], s, s.phase);
}
function methodRun(s, truth) {
  const run = runOf(state.method, s, truth);
  return state.method === "pit" ? { ...run, tracks: tracksOf(s, run), angles: run.spins && anglesOf(s, run) } : run;
}
export function solve() {
  const s = state.scene,
    run = pic(bare(s), MOST_IMPACTS),
    truth = { ...run, tracks: tracksOf(s, run), angles: run.spins && anglesOf(s, run) };
  const seen = methodRun(s, truth);
  return { truth, seen, score: seen && compare(s, truth, seen) };
}
methods.onchange = () => choose(methods.value);
