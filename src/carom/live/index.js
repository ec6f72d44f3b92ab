// Every method for a scene of the page, by what the scene needs; and what is not ported, by name.
import { num } from "./bodies.js";
import { solvePic, solvePit } from "./flying.js";
import { solvePicFalling, solvePitFalling } from "./falling.js";
import { Outline } from "./outline.js";

export const falls = (scene) => (scene.gravity_m_s2 ?? [0, 0]).some((g) => g !== 0);

// carom/limits.py: a scene whose numbers are not all within this is run by Carom in other units.
const ORDINARY = 2 ** 200;
const extreme = (x) => x !== 0 && Math.abs(x) !== Infinity && !(Math.abs(x) <= ORDINARY && Math.abs(x) >= 1 / ORDINARY);
const speedsOf = ({ legs = [], velocity_m_s = [] }) => [...velocity_m_s, ...legs.flatMap((leg) => leg.velocity_m_s)];
const lengthsOf = (wall) => {
  const speeds = [...speedsOf(wall), wall.surface_speed_m_s ?? 0];
  if (wall.normal) return [...wall.point_m, ...speeds];
  const { points, halfWidth, radius, stretches } = new Outline(wall);
  return [...points.flat(), halfWidth, radius ?? 0, ...speeds, ...stretches.flatMap((s) => [...(s.centre ?? []), s.radius])];
};
const numbersOf = (scene) => [
  scene.duration_s,
  ...(scene.gravity_m_s2 ?? []),
  ...scene.discs.flatMap((d) => [
    ...d.position_m,
    ...speedsOf(d),
    d.radius_m,
    num(d.mass_kg, 1),
    num(d.spin_rad_s, 0),
  ]),
  ...(scene.walls ?? []).flatMap(lengthsOf),
];

// What Carom's solvers take and these don't: the one list. Whatever a scene has that no one here knows is not ported either.
export const NOT_PORTED = {
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
  wall: [
    "point_m",
    "normal",
    "points_m",
    "bulges",
    "closed",
    "half_width_m",
    "solid",
    "pieces",
    "centre_m",
    "radius_m",
    "restitution",
    "friction",
    "velocity_m_s",
    "legs",
    "surface_speed_m_s",
  ],
};
export function refused(scene) {
  const named = Object.keys(NOT_PORTED).filter((name) => NOT_PORTED[name](scene));
  const unknown = (one, known) => Object.keys(one).filter((name) => !known.includes(name));
  return [
    ...named,
    ...new Set([
      ...unknown(scene, KNOWN.scene),
      ...scene.discs.flatMap((disc) => unknown(disc, KNOWN.disc)),
      ...(scene.walls ?? []).flatMap((wall) => unknown(wall, KNOWN.wall)),
    ]),
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
