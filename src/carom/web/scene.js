// Checks scenes of the page against its limits, and converts them to links and to files for `carom run`.
import { kept, undamped } from "./wasm_core.js";
import { isDriven, legsFrom, legsOf, movedOn } from "./prescribed_motion.js";
import { pit, refused } from "./run_methods.js";
import { Outline } from "./chain_geometry.js";
import { slowing, stopsAfter } from "./drawing.js";

export const MOST_DISCS = 10;
const MOST_WALLS = 8,
  MOST_LEGS = 20,
  MOST_POINTS = 40; // largest number of points of a wall
const LAWS = [
  "restitution",
  "wall_restitution",
  "friction",
  "wall_friction",
  "tangential_restitution",
  "wall_tangential_restitution",
  "wall_rolling_resistance",
  "damping_per_s",
  "table_deceleration_m_s2",
];
const DEFAULTS = {
  restitution: 1,
  wall_restitution: 1,
  friction: 0,
  wall_friction: 0,
  tangential_restitution: 0,
  wall_tangential_restitution: 0,
  wall_rolling_resistance: 0,
  damping_per_s: 0,
  table_deceleration_m_s2: 0,
};
export const isFixed = (disc) => disc.mass_kg === "inf";

// Allowed range of each number. The ranges that PIC and PIT allow are much larger.
const RANGES = {
  position: [-1e4, 1e4],
  speed: [-1e4, 1e4],
  radius: [1e-4, 1e3],
  mass: [1e-6, 1e9],
  spin: [-1e5, 1e5],
  inertia: [1e-3, 1],
  rate: [1, 10000],
  phase: [0, 0.999],
  duration: [1e-3, 60],
  gravity: [-1e3, 1e3],
  width: [0, 1e3],
  bulge: [-1e3, 1e3],
  restitution: [0, 1],
  wall_restitution: [0, 1],
  friction: [0, 100],
  wall_friction: [0, 100],
  tangential_restitution: [-1, 1],
  wall_tangential_restitution: [-1, 1],
  wall_rolling_resistance: [0, 100],
  damping_per_s: [0, 100],
  table_deceleration_m_s2: [0, 1e3],
};
export const inRange = (what, x) => typeof x === "number" && x >= RANGES[what][0] && x <= RANGES[what][1];
const checked = (what, x) => {
  if (!inRange(what, x))
    throw new RangeError(`${what.replaceAll("_", " ")} must be a number from ${RANGES[what].join(" to ")}`);
  return x;
};
const list = (value, what, least, most) => {
  if (!Array.isArray(value) || value.length < least || value.length > most)
    throw new RangeError(`the number of ${what} must be from ${least} to ${most}`);
  return value;
};

const vector = (kind, value) => list(value, "coordinates", 2, 2).map((x) => checked(kind, x));
const whether = (value) => {
  if (typeof value !== "boolean") throw new RangeError("closed, solid and driven must be true or false");
  return value;
};
function path(legs) {
  const checkedLegs = list(legs, "legs of a path", 1, MOST_LEGS).map(({ from_s, velocity_m_s }) => ({
    from_s: from_s === 0 ? 0 : checked("duration", from_s),
    velocity_m_s: vector("speed", velocity_m_s),
  }));
  if (checkedLegs.some(({ from_s }, k) => (k ? !(from_s > checkedLegs[k - 1].from_s) : from_s !== 0)))
    throw new RangeError("the first leg of a path must begin at 0, and each other leg after the previous one");
  return checkedLegs;
}
// Functions that check the fields of a wall. Links contain the fields in this order.
const OF_WALL = {
  point_m: (v) => vector("position", v),
  normal: (v) => vector("tangential_restitution", v),
  points_m: (v) => list(v, "points of a wall", 2, MOST_POINTS).map((point) => vector("position", point)),
  bulges: (v) => list(v, "bulges of a wall", 0, MOST_POINTS).map((bulge) => checked("bulge", bulge)),
  closed: whether,
  solid: whether,
  centre_m: (v) => vector("position", v),
  radius_m: (v) => checked("width", v),
  half_width_m: (v) => checked("width", v),
  restitution: (v) => checked("wall_restitution", v),
  friction: (v) => checked("wall_friction", v),
  velocity_m_s: (v) => vector("speed", v),
  surface_speed_m_s: (v) => checked("speed", v),
  legs: path,
};
const FIELDS_OF_WALL = Object.keys(OF_WALL);
function asPageWall(given) {
  const had = FIELDS_OF_WALL.filter((name) => !["undefined", "null", "[]"].includes(String(JSON.stringify(given[name])))),
    wall = Object.fromEntries(had.map((name) => [name, OF_WALL[name](given[name])]));
  const { point_m, normal, points_m, bulges, closed, centre_m, radius_m } = wall;
  if ([point_m && normal, points_m, centre_m && radius_m !== undefined].filter((kind) => kind).length !== 1)
    throw new RangeError("a wall must have a point and a normal, or points, or a centre and a radius");
  if (normal && !(Math.abs(Math.hypot(...normal) - 1) < 1e-9))
    throw new RangeError("the normal of a wall must have length 1");
  if (points_m?.some(([x, y], k) => (closed || k) && points_m.at(k - 1)[0] === x && points_m.at(k - 1)[1] === y))
    throw new RangeError("the ends of an edge must differ");
  if (bulges?.length && bulges.length !== points_m?.length - !closed)
    throw new RangeError("a wall must have a bulge for each of its edges, or none");
  return wall;
}
// Checks each field of a scene, and returns the scene with all fields that the page uses, including `phase`.
export function asPageScene(given, phase = 0) {
  const names = refused(given);
  if (names.length) throw new RangeError(`the page does not support ${names.join(", ")}`);
  const discs = list(given.discs, "discs", 1, MOST_DISCS).map((d) => ({
    position_m: vector("position", d.position_m),
    velocity_m_s: vector("speed", d.velocity_m_s ?? [0, 0]),
    radius_m: checked("radius", d.radius_m),
    mass_kg: isFixed(d) ? "inf" : checked("mass", d.mass_kg ?? 1),
    spin_rad_s: checked("spin", d.spin_rad_s ?? 0),
    inertia_factor: d.inertia_factor === "inf" ? "inf" : checked("inertia", d.inertia_factor ?? 0.5),
    ...(d.driven ? { driven: whether(d.driven) } : {}),
    ...(d.legs?.length ? { legs: path(d.legs) } : {}),
  }));
  if (discs.some((d) => isFixed(d) && !d.driven && [...d.velocity_m_s, d.spin_rad_s].some((x) => x !== 0)))
    throw new RangeError("an immovable disc must be at rest, unless it is driven");
  if (discs.some((d) => (d.driven && !isFixed(d)) || (d.legs && !d.driven))) throw new RangeError("a driven disc must be immovable");
  const walls = list(given.walls ?? [], "walls", 0, MOST_WALLS).map(asPageWall),
    gravity_m_s2 = list(given.gravity_m_s2 ?? [0, 0], "coordinates", 2, 2).map((x) => checked("gravity", x));
  if (given.damping_per_s && !mayBeDamped({ ...given, discs, walls, gravity_m_s2 }))
    throw new RangeError("damping can't be combined with gravity, driven bodies or a table");
  if (given.table_deceleration_m_s2 && !maySlow({ ...given, discs, walls, gravity_m_s2 }))
    throw new RangeError("a table can't be combined with gravity, spin, friction or driven bodies");
  return {
    name: "from-the-page",
    discs,
    walls,
    ...Object.fromEntries(LAWS.map((law) => [law, checked(law, given[law] ?? DEFAULTS[law])])),
    gravity_m_s2,
    duration_s: checked("duration", given.duration_s),
    frame_rate_hz: checked("rate", given.frame_rate_hz ?? 60),
    phase: checked("phase", phase),
  };
}
const isUnpulled = ({ discs, walls, gravity_m_s2: [gx, gy] }) =>
  gx === 0 && gy === 0 && !discs.some((d) => d.driven) && !walls.some((w) => w.surface_speed_m_s || isDriven(legsOf(w)));
export const mayBeDamped = (scene) => isUnpulled(scene) && !scene.table_deceleration_m_s2;
const maySlow = (scene) =>
  isUnpulled(scene) && ![...scene.discs.map((d) => d.spin_rad_s), scene.friction, scene.wall_friction, ...scene.walls.map((w) => w.friction)].some((x) => x);
// Returns the scene for Carom's solvers and engines, without the fields that only the page uses.
export const bare = ({ phase, ...scene }) => scene;

// --- a link: "#2=" is the version; decimal numbers that read back as the same floats follow ---
const VERSION = "2=",
  BEFORE = "1="; // earlier version with half-planes only, four numbers each
export function asLink(s, method) {
  const values = [
    s.discs.map((d) => [
      ...[...d.position_m, ...d.velocity_m_s, d.radius_m, d.mass_kg, d.spin_rad_s, d.inertia_factor],
      ...(d.driven ? [d.legs ?? true] : []), // the legs of the path; true if the path has no legs
    ]),
    s.walls.map((w) => FIELDS_OF_WALL.map((name) => w[name] ?? null)),
    LAWS.map((law) => s[law]),
    s.gravity_m_s2,
    s.duration_s,
    s.frame_rate_hz,
    s.phase,
    method,
  ];
  // without the replacement, JSON.stringify would write -0 as 0
  const text = JSON.stringify(values, (_, x) => (Object.is(x, -0) ? "-0" : x));
  return VERSION + btoa(text).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}
export function ofLink(text) {
  const before = text.startsWith(BEFORE);
  if (!before && !text.startsWith(VERSION)) throw new RangeError("the version of the link is unknown");
  if (text.length > 20000) throw new RangeError("the link is too long");
  const values = JSON.parse(atob(text.slice(VERSION.length).replaceAll("-", "+").replaceAll("_", "/")), (_, x) =>
    x === "-0" ? -0 : x,
  );
  const [discs, walls, laws, gravity_m_s2, duration_s, frame_rate_hz, phase, method] = list(values, "fields", 8, 8);
  if (typeof method !== "string") throw new RangeError("the method in the link must be a name");
  const wallOf = (row) => {
    const count = before ? 4 : FIELDS_OF_WALL.length,
      [px, py, nx, ny] = list(row, "numbers of a wall", count, count);
    if (before) return { point_m: [px, py], normal: [nx, ny] };
    return Object.fromEntries(FIELDS_OF_WALL.map((name, k) => [name, row[k]]).filter(([, value]) => value !== null));
  };
  const scene = {
    discs: list(discs, "discs", 1, MOST_DISCS).map((row) => {
      const [x, y, vx, vy, radius_m, mass_kg, spin_rad_s, inertia_factor, drive = false] = list(
        row,
        "numbers of a disc",
        8,
        9,
      );
      const disc = { position_m: [x, y], velocity_m_s: [vx, vy], radius_m, mass_kg, spin_rad_s, inertia_factor };
      return drive === true || drive === false ? { ...disc, driven: drive } : { ...disc, driven: true, legs: drive };
    }),
    walls: list(walls, "walls", 0, MOST_WALLS).map(wallOf),
    ...Object.fromEntries(LAWS.map((law, k) => [law, list(laws, "laws", 6, LAWS.length)[k]])),
    gravity_m_s2,
    duration_s,
    frame_rate_hz,
  };
  return { scene: asPageScene(scene, phase), method };
}

// Moves all bodies along their free paths by the phase of a scene (a fraction of a frame), so that PIT's first frame is
// at this time.
const legsAfter = (legs, by) =>
  legsFrom(legs, by).map(({ begin, velocity }, k) => ({ from_s: k ? begin - by : 0, velocity_m_s: velocity }));
function wallOn(wall, by) {
  const legs = legsOf(wall),
    moved = movedOn(legsFrom(legs, by)[0], by),
    on = (point) => point.map((x, k) => x + moved[k]),
    placed = Object.entries({ point_m: on, centre_m: on, points_m: (points) => points.map(on) });
  const there = placed.filter(([name]) => wall[name]).map(([name, to]) => [name, to(wall[name])]);
  return { ...wall, ...Object.fromEntries(there), ...(wall.legs ? { legs: legsAfter(legs, by) } : {}) };
}
export function advanced(s, by) {
  const rate = s.damping_per_s,
    left = kept(rate, by);
  const discs = s.discs.map((d) => {
    const lasts = Math.min(by, stopsAfter(s, d.velocity_m_s)),
      flown = undamped(rate, lasts),
      slow = slowing(s, d.velocity_m_s),
      pull = isFixed(d) ? [0, 0] : s.gravity_m_s2.map((g, k) => g + slow[k]),
      legs = d.legs ? legsOf(d) : null,
      moved = legs && movedOn(legsFrom(legs, by)[0], by);
    if (legs) return { ...d, position_m: d.position_m.map((x, k) => x + moved[k]), legs: legsAfter(legs, by) };
    return {
      ...d,
      position_m: d.position_m.map((x, k) => x + d.velocity_m_s[k] * flown + 0.5 * pull[k] * lasts * lasts),
      velocity_m_s: lasts < by ? [0, 0] : d.velocity_m_s.map((v, k) => left * v + pull[k] * lasts),
      spin_rad_s: left * d.spin_rad_s,
    };
  });
  return { ...s, duration_s: s.duration_s - by, discs, walls: s.walls.map((wall) => wallOn(wall, by)) };
}

// Runs PIT at the frame rate and phase of a scene.
export function pitOf(s) {
  const rate = s.frame_rate_hz,
    early = s.phase / rate;
  if (early >= s.duration_s) return pit(bare(s), rate, 0);
  const run = pit(bare(advanced(s, early)), rate);
  if (!early) return run;
  const later = (event) => ({ ...event, time_s: early + event.time_s });
  return { ...run, impacts: run.impacts.map(later), end_s: s.duration_s };
}

const decimal = (x) =>
  x === "inf" || typeof x === "boolean"
    ? String(x)
    : Array.isArray(x)
      ? `[${x.map(decimal).join(", ")}]`
      : typeof x === "object"
        ? `{ ${Object.entries(x).map(([name, value]) => `${name} = ${decimal(value)}`).join(", ")} }`
      : Object.is(x, -0)
      ? "-0.0"
      : Number.isInteger(x) && Math.abs(x) < 1e15
        ? x.toFixed(1)
        : String(x);
const tomlRow = (name, value) => `${name} = ${decimal(value)}\n`;
export function asToml(s) {
  const start = s.phase ? advanced(s, s.phase / s.frame_rate_hz) : s;
  const said = s.phase
    ? `description = "Advanced by ${s.phase} of a frame, so that its frames are those of the page."\n`
    : "";
  const fields = ["gravity_m_s2", "duration_s", "frame_rate_hz", ...LAWS];
  const table = (head, names, one) => head + names.map((name) => tomlRow(name, one[name])).join("");
  return [
    `name = "${s.name}"\n${said}`,
    table("", fields, start),
    ...start.discs.map((d) => table("\n[[discs]]\n", Object.keys(d), d)),
    ...start.walls.map((w) => table("\n[[walls]]\n", Object.keys(w), w)),
  ].join("");
}

// Returns a text that names the bodies whose overlap prevents the scene from starting, or nothing if it can start.
export function problemOf(s) {
  for (const [j, d] of s.discs.entries()) {
    for (const [i, e] of s.discs.slice(0, j).entries())
      if (Math.hypot(d.position_m[0] - e.position_m[0], d.position_m[1] - e.position_m[1]) < d.radius_m + e.radius_m)
        return `discs ${i} and ${j} overlap`;
    for (const [k, wall] of s.walls.entries()) if (isInWall(d, wall)) return `disc ${j} is in wall ${k}`;
  }
  return "";
}
function isInWall({ position_m: [x, y], radius_m }, wall) {
  const { point_m: p, normal: n } = wall;
  if (n) return (x - p[0]) * n[0] + (y - p[1]) * n[1] < radius_m;
  const outline = outlineOf(wall),
    { at } = outline.nearest(x, y);
  return Math.hypot(x - at[0], y - at[1]) < outline.halfWidth + radius_m || (wall.solid && outline.encloses(x, y));
}
// Outlines of walls. Outlines can be cached, because edits replace a wall instead of changing it.
const outlines = new WeakMap();
export function outlineOf(wall) {
  if (!outlines.has(wall)) outlines.set(wall, new Outline(wall));
  return outlines.get(wall);
}
