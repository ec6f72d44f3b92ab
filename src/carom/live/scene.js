// The scene of the page: what may be asked of it, as a link, and as a file that `carom run` takes.
import { refused } from "./index.js";

export const MOST_DISCS = 10,
  MOST_WALLS = 8;
const LAWS = [
  "restitution",
  "wall_restitution",
  "friction",
  "wall_friction",
  "tangential_restitution",
  "wall_tangential_restitution",
];
const DEFAULTS = {
  restitution: 1,
  wall_restitution: 1,
  friction: 0,
  wall_friction: 0,
  tangential_restitution: 0,
  wall_tangential_restitution: 0,
};
export const isFixed = (disc) => disc.mass_kg === "inf";

// What a link and the page take of each number: far inside of what PIC and PIT compute with.
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
  restitution: [0, 1],
  wall_restitution: [0, 1],
  friction: [0, 100],
  wall_friction: [0, 100],
  tangential_restitution: [-1, 1],
  wall_tangential_restitution: [-1, 1],
};
export const inRange = (what, x) => typeof x === "number" && x >= RANGES[what][0] && x <= RANGES[what][1];
const checked = (what, x) => {
  if (!inRange(what, x))
    throw new RangeError(`${what.replaceAll("_", " ")} must be a number from ${RANGES[what].join(" to ")}`);
  return x;
};
const list = (value, what, least, most) => {
  if (!Array.isArray(value) || value.length < least || value.length > most)
    throw new RangeError(`${what}: from ${least} to ${most} of them`);
  return value;
};

// A scene with every field that the page knows, each checked; rate and phase of the looks are part of it.
export function asPageScene(given, phase = 0) {
  const names = refused(given);
  if (names.length) throw new RangeError(`the page does not know ${names.join(", ")}`);
  const discs = list(given.discs, "discs", 1, MOST_DISCS).map((d) => ({
    position_m: list(d.position_m, "coordinates", 2, 2).map((x) => checked("position", x)),
    velocity_m_s: list(d.velocity_m_s ?? [0, 0], "coordinates", 2, 2).map((x) => checked("speed", x)),
    radius_m: checked("radius", d.radius_m),
    mass_kg: isFixed(d) ? "inf" : checked("mass", d.mass_kg ?? 1),
    spin_rad_s: checked("spin", d.spin_rad_s ?? 0),
    inertia_factor: d.inertia_factor === "inf" ? "inf" : checked("inertia", d.inertia_factor ?? 0.5),
  }));
  if (discs.some((d) => isFixed(d) && [...d.velocity_m_s, d.spin_rad_s].some((x) => x !== 0)))
    throw new RangeError("an immovable disc does not move");
  const walls = list(given.walls ?? [], "walls", 0, MOST_WALLS).map(({ point_m, normal }) => {
    const length = Math.sqrt(list(normal, "coordinates", 2, 2)[0] ** 2 + normal[1] ** 2);
    if (!(Math.abs(length - 1) < 1e-9)) throw new RangeError("the normal of a wall must be of length 1");
    return { point_m: list(point_m, "coordinates", 2, 2).map((x) => checked("position", x)), normal: [...normal] };
  });
  return {
    name: "from-the-page",
    discs,
    walls,
    ...Object.fromEntries(LAWS.map((law) => [law, checked(law, given[law] ?? DEFAULTS[law])])),
    gravity_m_s2: list(given.gravity_m_s2 ?? [0, 0], "coordinates", 2, 2).map((x) => checked("gravity", x)),
    duration_s: checked("duration", given.duration_s),
    frame_rate_hz: checked("rate", given.frame_rate_hz ?? 60),
    phase: checked("phase", phase),
  };
}
// As Carom's solvers and engines take it: without what is the page's own.
export const bare = ({ phase, ...scene }) => scene;

// --- a link: "#1=" is the version; numbers as decimals keep every bit ---
const VERSION = "1=";
export function asLink(s, method) {
  const values = [
    s.discs.map((d) => [...d.position_m, ...d.velocity_m_s, d.radius_m, d.mass_kg, d.spin_rad_s, d.inertia_factor]),
    s.walls.map((w) => [...w.point_m, ...w.normal]),
    LAWS.map((law) => s[law]),
    s.gravity_m_s2,
    s.duration_s,
    s.frame_rate_hz,
    s.phase,
    method,
  ];
  // JSON writes -0 as 0, which is another float
  const text = JSON.stringify(values, (_, x) => (Object.is(x, -0) ? "-0" : x));
  return VERSION + btoa(text).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}
export function ofLink(text) {
  if (!text.startsWith(VERSION)) throw new RangeError("it is of a version that this page does not know");
  if (text.length > 20000) throw new RangeError("it is too long");
  const values = JSON.parse(atob(text.slice(VERSION.length).replaceAll("-", "+").replaceAll("_", "/")), (_, x) =>
    x === "-0" ? -0 : x,
  );
  const [discs, walls, laws, gravity_m_s2, duration_s, frame_rate_hz, phase, method] = list(values, "fields", 8, 8);
  if (typeof method !== "string") throw new RangeError("its method is no name");
  const scene = {
    discs: list(discs, "discs", 1, MOST_DISCS).map((row) => {
      const [x, y, vx, vy, radius_m, mass_kg, spin_rad_s, inertia_factor] = list(row, "numbers of a disc", 8, 8);
      return { position_m: [x, y], velocity_m_s: [vx, vy], radius_m, mass_kg, spin_rad_s, inertia_factor };
    }),
    walls: list(walls, "walls", 0, MOST_WALLS).map((row) => {
      const [px, py, nx, ny] = list(row, "numbers of a wall", 4, 4);
      for (const n of [nx, ny])
        if (!inRange("tangential_restitution", n)) throw new RangeError("a normal must be two numbers");
      return { point_m: [px, py], normal: [nx, ny] };
    }),
    ...Object.fromEntries(LAWS.map((law, k) => [law, list(laws, "laws", LAWS.length, LAWS.length)[k]])),
    gravity_m_s2,
    duration_s,
    frame_rate_hz,
  };
  return { scene: asPageScene(scene, phase), method };
}

// Every disc where free flight brings it by then: looks at k frames from there are those of the phase.
export function advanced(s, by) {
  const discs = s.discs.map((d) => {
    const pull = isFixed(d) ? [0, 0] : s.gravity_m_s2;
    return {
      ...d,
      position_m: d.position_m.map((x, k) => x + d.velocity_m_s[k] * by + 0.5 * pull[k] * by * by),
      velocity_m_s: d.velocity_m_s.map((v, k) => v + pull[k] * by),
    };
  });
  return { ...s, duration_s: s.duration_s - by, discs };
}

const decimal = (x) =>
  x === "inf"
    ? "inf"
    : Object.is(x, -0)
      ? "-0.0"
      : Number.isInteger(x) && Math.abs(x) < 1e15
        ? x.toFixed(1)
        : String(x);
const row = (name, value) =>
  `${name} = ${Array.isArray(value) ? `[${value.map(decimal).join(", ")}]` : decimal(value)}\n`;
export function asToml(s) {
  const start = s.phase ? advanced(s, s.phase / s.frame_rate_hz) : s;
  const said = s.phase
    ? `description = "Taken forward by ${s.phase} of a frame: the looks at whole frames are those of the page."\n`
    : "";
  const fields = ["gravity_m_s2", "duration_s", "frame_rate_hz", ...LAWS];
  const discs = start.discs.map(
    (d) =>
      "\n[[discs]]\n" +
      Object.keys(d)
        .map((name) => row(name, d[name]))
        .join(""),
  );
  const walls = start.walls.map((w) => "\n[[walls]]\n" + row("point_m", w.point_m) + row("normal", w.normal));
  return `name = "${s.name}"\n${said}${fields.map((name) => row(name, start[name])).join("")}${discs.join("")}${walls.join("")}`;
}

// Why a scene is no start, or nothing: bodies that overlap have no past.
export function problemOf(s) {
  for (const [j, d] of s.discs.entries()) {
    for (const [i, e] of s.discs.slice(0, j).entries())
      if (Math.hypot(d.position_m[0] - e.position_m[0], d.position_m[1] - e.position_m[1]) < d.radius_m + e.radius_m)
        return `discs ${i} and ${j} overlap`;
    for (const [k, { point_m: p, normal: n }] of s.walls.entries())
      if ((d.position_m[0] - p[0]) * n[0] + (d.position_m[1] - p[1]) * n[1] < d.radius_m)
        return `disc ${j} is in wall ${k}`;
  }
  return "";
}
