// Converts scenes to units in which no computation overflows, as carom/solvers/units.py does. Units are powers of two,
// so conversions do not round.
import { isDriven, legsOf } from "./prescribed_motion.js";
import { exponent } from "./arithmetic.js";
import { lengthsOf } from "./obstacles.js";
import { num } from "./arithmetic.js";

const ORDINARY = 2 ** 200,
  FASTEST_POWER = 100;
const isOrdinary = (x) => x === 0 || Math.abs(x) === Infinity || (Math.abs(x) <= ORDINARY && Math.abs(x) >= 1 / ORDINARY);
const most = (numbers) => numbers.reduce((found, x) => Math.max(found, Math.abs(x)), 0);
const middle = (least, greatest) => Math.floor((exponent(least) + exponent(greatest)) / 2);

// Returns units of length, time and mass as powers of two, or null if no computation can overflow in SI units.
export function unitsOf({ discs, walls, gravity_m_s2, duration_s }, outlines) {
  const radii = discs.map((d) => d.radius_m),
    places = discs.flatMap((d) => d.position_m),
    lengths = walls.flatMap((wall, k) => (outlines[k] ? lengthsOf(outlines[k]) : wall.point_m)),
    masses = discs.map((d) => num(d.mass_kg, 1)),
    rims = discs.map((d) => d.radius_m * num(d.spin_rad_s, 0));
  const speeds = [
    ...discs.flatMap((d) => (d.legs?.[0] ?? d).velocity_m_s ?? [0, 0]),
    ...[...walls, ...discs.filter((d) => d.driven)].map(legsOf).filter(isDriven).flatMap((legs) => legs.flatMap(({ velocity }) => velocity)),
    ...walls.map((wall) => wall.surface_speed_m_s ?? 0),
    ...rims,
  ];
  if ([...places, ...radii, ...lengths, ...speeds, ...masses, duration_s, ...gravity_m_s2].every(isOrdinary)) return null;
  const speed = Math.max(most(speeds), most(gravity_m_s2.map((g) => g * duration_s))),
    length = middle(Math.min(...radii), Math.max(most([...places, ...radii, ...lengths]), speed * duration_s)),
    finite = masses.filter((mass) => mass < Infinity);
  return {
    length,
    time: speed > 0 ? length + FASTEST_POWER - exponent(speed) : exponent(duration_s),
    mass: finite.length ? middle(Math.min(...finite), Math.max(...finite)) : middle(1, 1),
  };
}

// Converts a scene to the given units. `scaled` multiplies a number by a power of two.
export function inUnits(scene, { length, time, mass }, scaled) {
  const speed = length - time,
    of = (power) => (x) => (typeof x === "number" ? scaled(x, -power) : x),
    vector = (power) => (xs) => xs.map(of(power)),
    legs = (all) => all.map((leg) => ({ from_s: of(time)(leg.from_s), velocity_m_s: vector(speed)(leg.velocity_m_s) }));
  const kinds = {
    position_m: vector(length),
    point_m: vector(length),
    centre_m: vector(length),
    points_m: (points) => points.map(vector(length)),
    radius_m: of(length),
    half_width_m: of(length),
    mass_kg: of(mass),
    velocity_m_s: vector(speed),
    surface_speed_m_s: of(speed),
    spin_rad_s: of(-time),
    legs,
    gravity_m_s2: vector(speed - time),
    table_deceleration_m_s2: of(speed - time),
    damping_per_s: of(-time),
    duration_s: of(time),
    frame_rate_hz: of(-time),
  };
  const each = (one) => Object.fromEntries(Object.entries(one).map(([name, x]) => [name, x !== null && kinds[name] ? kinds[name](x) : x]));
  return { ...each(scene), discs: scene.discs.map(each), walls: scene.walls.map(each) };
}
// Converts a run from the given units to SI units. `scaled` multiplies a number by a power of two.
export function outOfUnits(run, { length, time }, scaled) {
  const speed = length - time,
    by = (power) => (x) => (Array.isArray(x) ? x.map(by(power)) : scaled(x, power)),
    seconds = by(time),
    spins = (x) => x && by(-time)(x);
  return {
    ...run,
    end_s: seconds(run.end_s),
    positions: by(length)(run.positions),
    velocities: by(speed)(run.velocities),
    spins: spins(run.spins),
    impacts: run.impacts.map((impact) => ({
      ...impact,
      time_s: seconds(impact.time_s),
      before: by(speed)(impact.before),
      after: by(speed)(impact.after),
      at: by(length)(impact.at),
      spins: spins(impact.spins),
    })),
    modes: run.modes && run.modes.map((mode) => ({
      ...mode,
      time_s: seconds(mode.time_s),
      at: by(length)(mode.at),
      velocity: by(speed)(mode.velocity),
      acceleration: by(speed - time)(mode.acceleration),
      spin: by(-time)(mode.spin),
      spin_rate: by(-2 * time)(mode.spin_rate),
    })),
  };
}
