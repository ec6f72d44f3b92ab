// Runs scenes with PIC and PIT on the core, and checks scenes for unsupported fields.
import { num } from "./arithmetic.js";
import { damped, kept, latestUndamped, runPic, runPit, timesPower, whenAsked } from "./wasm_core.js";
import { isDriven, legsOf } from "./prescribed_motion.js";
import { Obstacles, chainRows, drivenRows } from "./obstacles.js";
import { addCentres } from "./impact_positions.js";
import { frac } from "./rational.js";
import { inUnits, outOfUnits, unitsOf } from "./units.js";

export const falls = (scene) => (scene.gravity_m_s2 ?? [0, 0]).some((g) => g !== 0);

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
// Returns the fields of a scene that the page does not support, so that no field is silently ignored.
export function refused(scene) {
  const unknown = (one, known) => Object.keys(one).filter((name) => !known.includes(name));
  return [
    ...new Set([
      ...unknown(scene, KNOWN.scene),
      ...scene.discs.flatMap((disc) => unknown(disc, KNOWN.disc)),
      ...(scene.walls ?? []).flatMap((wall) => unknown(wall, KNOWN.wall)),
    ]),
  ];
}
// Returns a scene for the core. Throws an error if the scene has unsupported fields.
function whole(scene) {
  const names = refused(scene);
  if (names.length) throw new RangeError(`the page does not support ${names.join(", ")}`);
  return { ...scene, walls: scene.walls ?? [], gravity_m_s2: scene.gravity_m_s2 ?? [0, 0] };
}

// This limit has the same formula as `compute_standstill_limit` of carom/solvers/event_driven/run.py.
const standstillImpacts = (bodies) => Math.min(100 * bodies ** 2, 10_000_000 + Math.floor(bodies ** 2 / 2));
const materialsOf = ({ walls, wall_restitution, wall_friction }) =>
  walls.map((wall) => [wall.restitution ?? num(wall_restitution, 1), wall.friction ?? num(wall_friction, 0)]);

function inputOf(scene) {
  const { discs, walls, gravity_m_s2 } = scene,
    materials = materialsOf(scene),
    obstacles = new Obstacles(walls, Math.max(...discs.map((d) => d.radius_m))),
    spins = discs.map((d) => num(d.spin_rad_s, 0)),
    friction = num(scene.friction, 0);
  const hasSpins =
    (friction > 0 && discs.length > 1) || materials.some(([, wallFriction]) => wallFriction > 0) || spins.some((w) => w !== 0);
  const arrays = {
    positions: discs.map((d) => d.position_m),
    velocities: discs.map((d) => (d.legs?.[0] ?? d).velocity_m_s ?? [0, 0]),
    radii: discs.map((d) => d.radius_m),
    masses: discs.map((d) => num(d.mass_kg, 1)),
    spins,
    inertias: discs.map((d) => num(d.inertia_factor, 0.5)),
    materials,
  };
  const numbers = {
    restitution: num(scene.restitution, 1),
    wallRestitution: num(scene.wall_restitution, 1),
    friction,
    wallFriction: num(scene.wall_friction, 0),
    tangentialRestitution: num(scene.tangential_restitution, 0),
    wallTangentialRestitution: num(scene.wall_tangential_restitution, 0),
    gravityX: gravity_m_s2[0],
    gravityY: gravity_m_s2[1],
    tableDeceleration: scene.table_deceleration_m_s2 ?? 0,
    rollingResistance: scene.wall_rolling_resistance ?? 0,
    hasSpins,
    standstill: standstillImpacts(discs.length + walls.length),
    duration: scene.duration_s,
  };
  return { arrays, numbers, obstacles };
}
// Returns the rows that only PIC reads. If no body is driven or accelerated, half-planes with the scene's coefficients
// need no rows.
function picArrays(scene, { arrays, numbers, obstacles }) {
  const { discs, walls } = scene,
    { materials, ...others } = arrays,
    [driven, legs] = drivenRows(scene),
    own = materials.some(([e, f]) => e !== numbers.wallRestitution || f !== numbers.wallFriction),
    accelerates = falls(scene) || numbers.tableDeceleration !== 0,
    isPlain = !own && walls.every((wall) => wall.normal) && !driven.length && !discs.some((d) => d.driven) && !accelerates;
  if (isPlain) return { ...others, walls: walls.map((wall) => [...wall.point_m, ...wall.normal]) };
  const [grounds, neverLists] = accelerates ? obstacles.grounds() : [[], []];
  return { ...others, features: obstacles.rows, materials, driven, legs, grounds, neverLists };
}

// Runs a scene in units of length, time and mass with which no computation overflows.
function inOrdinaryUnits(scene, rate, run) {
  const units = unitsOf(scene, new Obstacles(scene.walls, Infinity).outlines);
  if (units === null) return run(scene, rate);
  return outOfUnits(run(inUnits(scene, units, timesPower), timesPower(rate, units.time)), units, timesPower);
}
const LARGEST = 2 ** 1023 * (2 - 2 ** -52);
const rateOf = ({ damping_per_s = 0 }) => Math.min(damping_per_s, LARGEST);

export function pic(given, maxImpacts = Infinity) {
  return inOrdinaryUnits(whole(given), 1, (scene) => {
    const input = inputOf(scene),
      arrays = picArrays(scene, input),
      damping = rateOf(scene),
      duration = damping ? latestUndamped(damping, scene.duration_s) : scene.duration_s;
    whenAsked({ isOrderFree: (...corner) => input.obstacles.isOrderFree(...corner) });
    const run = runPic(arrays, { ...input.numbers, duration }, maxImpacts);
    return addCentres(scene, damping ? slowed(run, damping, scene.duration_s) : run);
  });
}
// Converts the run of a scene without damping to the run of the same scene with damping.
function slowed(run, damping, duration_s) {
  const by = (part) => (x) => (Array.isArray(x) ? x.map(by(part)) : x * part),
    end_s = run.outcome === "completed" ? duration_s : damped(damping, run.end_s),
    left = by(kept(damping, end_s));
  const impacts = run.impacts.map((impact) => {
    const now = by(1 - damping * impact.time_s),
      { before, after, spins } = impact;
    return { ...impact, time_s: damped(damping, impact.time_s), before: now(before), after: now(after), spins: spins && now(spins) };
  });
  return { ...run, impacts, end_s, velocities: left(run.velocities), spins: run.spins && left(run.spins) };
}

// Returns the number of frames before the end, computed exactly, like count_steps of carom.model.sizes.
function framesBefore(duration, dt) {
  const [a, e] = frac(duration),
    [c, f] = frac(dt),
    all = a << BigInt(f),
    part = c << BigInt(e),
    nearest = (2n * all + part) / (2n * part);
  let off = all - nearest * part;
  if (off < 0n) off = -off;
  return Number(nearest > 0n && off * (1n << 52n) <= all ? nearest : (all + part - 1n) / part);
}
// Runs PIT for a number of frames, or up to the end. PIT checks for overlap at the times k / rate.
export function pit(given, frameRate = num(given.frame_rate_hz, 60), frames = null) {
  return inOrdinaryUnits(whole(given), frameRate, (scene, rate) => {
    const { arrays, numbers, obstacles } = inputOf(scene),
      [chains, edges] = chainRows(obstacles),
      [driven, legs] = drivenRows(scene);
    return addCentres(
      scene,
      runPit(
        { ...arrays, chains, edges, driven, legs },
        { ...numbers, frameRate: rate, damping: rateOf(scene) },
        frames ?? framesBefore(scene.duration_s, 1 / rate),
      ),
    );
  });
}
