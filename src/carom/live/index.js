// Every method for a scene of the page, by what the scene needs; and what is not ported, by name.
import { num } from "./bodies.js";
import { solvePic, solvePit } from "./flying.js";
import { solvePicFalling, solvePitFalling } from "./falling.js";

export const falls = (scene) => (scene.gravity_m_s2 ?? [0, 0]).some((g) => g !== 0);

// carom/limits.py: a scene whose numbers are not all within this is run by Carom in other units.
const ORDINARY = 2 ** 200;
const extreme = (x) => x !== 0 && Math.abs(x) !== Infinity && !(Math.abs(x) <= ORDINARY && Math.abs(x) >= 1 / ORDINARY);
const numbersOf = (scene) => [
  scene.duration_s,
  ...(scene.gravity_m_s2 ?? []),
  ...scene.discs.flatMap((d) => [
    ...d.position_m,
    ...(d.velocity_m_s ?? []),
    d.radius_m,
    num(d.mass_kg, 1),
    num(d.spin_rad_s, 0),
  ]),
];

// What Carom's solvers take and these don't: the one list. Whatever a scene has that no one here knows is not ported either.
export const NOT_PORTED = {
  "walls of edges, arcs or circles": (scene) => (scene.walls ?? []).some((wall) => !("normal" in wall)),
  "walls of their own material": (scene) =>
    (scene.walls ?? []).some((wall) => wall.restitution != null || wall.friction != null),
  "driven walls": (scene) => (scene.walls ?? []).some((wall) => (wall.velocity_m_s ?? [0, 0]).some((v) => v !== 0)),
  "driven discs": (scene) => scene.discs.some((disc) => disc.driven),
  "driven bodies whose velocity changes": (scene) =>
    [...scene.discs, ...(scene.walls ?? [])].some((body) => (body.legs ?? []).length),
  "walls whose surface runs": (scene) => (scene.walls ?? []).some((wall) => wall.surface_speed_m_s),
  damping: (scene) => (scene.damping_per_s ?? 0) !== 0,
  "rolling resistance": (scene) => (scene.wall_rolling_resistance ?? 0) !== 0,
  "a table that slows discs down": (scene) => (scene.table_deceleration_m_s2 ?? 0) !== 0,
  "numbers of extreme size": (scene) => numbersOf(scene).some(extreme),
};
const KNOWN = {
  scene: [
    "name",
    "description",
    "discs",
    "walls",
    "restitution",
    "wall_restitution",
    "friction",
    "wall_friction",
    "tangential_restitution",
    "wall_tangential_restitution",
    "gravity_m_s2",
    "damping_per_s",
    "wall_rolling_resistance",
    "table_deceleration_m_s2",
    "duration_s",
    "frame_rate_hz",
  ],
  disc: ["position_m", "velocity_m_s", "radius_m", "mass_kg", "driven", "legs", "spin_rad_s", "inertia_factor"],
};
export function refused(scene) {
  const named = Object.keys(NOT_PORTED).filter((name) => NOT_PORTED[name](scene));
  const unknown = (one, known) => Object.keys(one).filter((name) => !known.includes(name));
  return [
    ...named,
    ...new Set([...unknown(scene, KNOWN.scene), ...scene.discs.flatMap((disc) => unknown(disc, KNOWN.disc))]),
  ];
}
const taken = (scene) => {
  const names = refused(scene);
  if (names.length) throw new RangeError(`not ported to JavaScript: ${names.join(", ")}`);
  return scene;
};

export const pic = (scene, maxImpacts) => (falls(taken(scene)) ? solvePicFalling : solvePic)(scene, maxImpacts);
export const pit = (scene, rate, phase = 0) =>
  (falls(taken(scene)) ? solvePitFalling : solvePit)(scene, rate, { phase });
