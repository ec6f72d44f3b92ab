// Computes the positions of both discs at impacts, for drawing. The core records only one position for each impact.
import { legsFrom, legsOf, movedOn } from "./prescribed_motion.js";
import { num } from "./arithmetic.js";
import { flownIn, slowing, stopsAfter } from "./drawing.js";

// Adds the centres of both discs to each impact of a run. Velocities are those that the core has recorded, so rounding
// errors of positions do not grow from impact to impact.
export function addCentres(scene, run) {
  const begun = scene.discs.map((disc) => ({
    path: disc.driven ? legsOf(disc) : null,
    start: disc.position_m,
    isFree: num(disc.mass_kg, 1) < Infinity,
    since: 0,
    at: disc.position_m,
    velocity: disc.velocity_m_s ?? [0, 0],
    pull: pullOf(disc),
  }));
  function pullOf(disc, velocity = disc.velocity_m_s ?? [0, 0]) {
    if (num(disc.mass_kg, 1) === Infinity) return [0, 0];
    return scene.gravity_m_s2.map((g, k) => g + slowing(scene, velocity)[k]);
  }
  function placeOf({ path, start, isFree, since, at, velocity, pull }, time) {
    if (path) {
      const moved = movedOn(legsFrom(path, time)[0], time);
      return start.map((x, k) => x + moved[k]);
    }
    if (!isFree) return at;
    const lasts = Math.min(time - since, stopsAfter(scene, velocity)),
      way = flownIn(scene, lasts);
    return at.map((x, k) => x + velocity[k] * way + 0.5 * pull[k] * lasts * lasts);
  }
  const modes = [...(run.modes ?? [])],
    follow = (count) => {
      while (modes.length && modes[0].impacts <= count) {
        const { disc, time_s, at, velocity, acceleration } = modes.shift();
        Object.assign(begun[disc], { since: time_s, at, velocity, pull: acceleration });
      }
    };
  const impacts = run.impacts.map((impact, count) => {
    follow(count);
    const { first, second, time_s, after } = impact,
      at = [impact.at[0], ...(second >= 0 ? [placeOf(begun[second], time_s)] : [])];
    at.forEach((place, k) => {
      const disc = k ? second : first;
      Object.assign(begun[disc], { since: time_s, at: place, velocity: after[k], pull: pullOf(scene.discs[disc], after[k]) });
    });
    return { ...impact, at };
  });
  return { ...run, impacts };
}
