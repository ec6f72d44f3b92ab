// Calls Carom's core in WebAssembly: passes the arguments of a run, and reads the rows of its result. The names and
// their order must be the same as in carom/core/wasm.
import { exactFall } from "./quartic.js";

const ARRAYS = [
  ...["positions", "velocities", "radii", "masses", "spins", "inertias", "walls", "features", "materials", "driven"],
  ...["legs", "grounds", "neverLists", "chains", "edges"],
];
const NUMBERS = [
  ...["restitution", "wallRestitution", "friction", "wallFriction", "tangentialRestitution", "wallTangentialRestitution"],
  ...["gravityX", "gravityY", "tableDeceleration", "rollingResistance", "damping", "hasSpins", "standstill"],
  ...["frameRate", "duration"],
];
const RESULTS = [
  ...["impacts", "impactCount", "spins", "contacts", "modes", "modeCount", "ambiguous", "ambiguousCount", "ending"],
  ...["reported", "now", "nowLow", "epoch", "epochRest", "isTooFar"],
];
const QUARTIC_POWERS = 5,
  MOST_PRODUCTS = 36;

let core = null;
// Function that the core calls: whether two simultaneous impacts at a corner have the same result in both orders.
const asked = { isOrderFree: () => false };
export const whenAsked = (answers) => Object.assign(asked, answers);

const floats = (address, count) => new Float64Array(core.memory.buffer, address, count);
function solveQuartic(from, isClosed, countsAt, productsAt, index) {
  const counts = new Int32Array(core.memory.buffer, countsAt, QUARTIC_POWERS),
    powers = Array.from(counts, (count, k) => {
      const row = floats(productsAt + 16 * MOST_PRODUCTS * k, 2 * count);
      return Array.from({ length: count }, (_, n) => [row[2 * n], row[2 * n + 1]]);
    });
  return exactFall(powers, from, isClosed !== 0, index);
}
export async function startCore(bytes) {
  const { instance } = await WebAssembly.instantiate(bytes, {
    carom: {
      is_order_free: (one, other, elastic) => Number(asked.isOrderFree(one, other, elastic !== 0)),
      solve_quartic: solveQuartic,
    },
  });
  core = instance.exports;
}

// Functions of the core for motion with damping, as in carom/model/damping.py; see damping.h.
export const kept = (rate, time) => core.kept(rate, time);
export const undamped = (rate, time) => core.undamped(rate, time);
export const damped = (rate, time) => core.damped(rate, time);
export const latestUndamped = (rate, time) => core.latest_undamped(rate, time);
export const timesPower = (x, exponent) => core.times_power(x, exponent);

const required = (enough) => {
  if (!enough) throw new RangeError("not enough memory for this run");
};
// Passes arrays (lists of numbers or of rows) and numbers to the core.
function give(arrays, numbers) {
  core.begin_input();
  for (const [name, rows] of Object.entries(arrays)) {
    const values = rows.flat();
    if (!values.length) continue;
    const address = core.add_array(ARRAYS.indexOf(name), values.length);
    required(address);
    floats(address, values.length).set(values);
  }
  const all = floats(core.numbers(), NUMBERS.length);
  for (const [name, value] of Object.entries(numbers)) all[NUMBERS.indexOf(name)] = Number(value);
}
const IMPACT = 13, // number of 8-byte values in the row of an impact, as in carom_core.h and accelerated_state.h
  MODE = 14;
function results() {
  const values = floats(core.results(), RESULTS.length);
  return Object.fromEntries(RESULTS.map((name, k) => [name, values[k]]));
}
// Reads a 64-bit integer as two integers of 32 bits.
const wholeAt = (row) => new Int32Array(row.buffer, row.byteOffset, 2 * row.length);
const pair = (row, at) => [row[at], row[at + 1]];
function impactsOf({ impacts, impactCount, spins, contacts }) {
  return Array.from({ length: impactCount }, (_, k) => {
    const row = floats(impacts + 8 * IMPACT * k, IMPACT),
      whole = wholeAt(row),
      contact = floats(contacts + 24 * k, 3);
    return {
      time_s: row[0],
      first: whole[2],
      second: whole[4],
      normal: pair(row, 3),
      before: [pair(row, 5), pair(row, 7)],
      after: [pair(row, 9), pair(row, 11)],
      spins: spins ? Array.from(floats(spins + 32 * k, 4)) : null,
      at: [pair(contact, 0)],
      feature: wholeAt(contact)[4],
    };
  });
}
function modesOf({ modes, modeCount }) {
  if (!modeCount) return null;
  return Array.from({ length: modeCount }, (_, k) => {
    const row = floats(modes + 8 * MODE * k, MODE),
      whole = wholeAt(row);
    return {
      time_s: row[0],
      impacts: whole[2],
      disc: whole[4],
      wall: whole[6],
      before: whole[8],
      after: whole[10],
      at: pair(row, 6),
      velocity: pair(row, 8),
      acceleration: pair(row, 10),
      spin: row[12],
      spin_rate: row[13],
    };
  });
}
function statesOf(address, discs, hasSpins) {
  required(address);
  const states = Array.from({ length: discs }, (_, i) => Array.from(floats(address + 32 * i, 4)));
  return {
    positions: states.map((state) => state.slice(0, 2)),
    velocities: states.map((state) => state.slice(2)),
    spins: hasSpins ? Array.from(floats(address + 32 * discs, discs)) : null,
  };
}
function found(ended) {
  if (ended.isTooFar) throw new RangeError("two discs met so far from the origin that floats can't distinguish their centres");
  const ambiguous = Array.from({ length: ended.ambiguousCount }, (_, k) => new Int32Array(core.memory.buffer, ended.ambiguous + 8 * k, 1)[0]);
  return { impacts: impactsOf(ended), modes: modesOf(ended), ambiguous };
}

// The ways in which a run of PIC can end, in the order of `Ending` in pic/state.h.
const NO_MEMORY = 4;
const OUTCOMES = [
  ...["completed", "max_impacts", "standstill", "pause", "no_memory", "glides", "crushed", "outgrown"],
  ...["at_rest", "pressed", "corner", "edge"],
];
const MOST = 2 ** 31 - 1;
export function runPic(arrays, numbers, maxImpacts) {
  give(arrays, numbers);
  required(core.begin_pic());
  core.advance_pic(numbers.duration, Math.min(maxImpacts, MOST));
  const ended = results(),
    hasCompleted = ended.ending === 0,
    end_s = hasCompleted ? numbers.duration : ended.reported,
    accelerates = numbers.gravityX || numbers.gravityY || numbers.tableDeceleration,
    instant = accelerates
      ? hasCompleted && (end_s > ended.now || (end_s === ended.now && ended.nowLow < 0))
        ? [end_s, 0]
        : [ended.now, ended.nowLow]
      : [end_s - ended.epoch - ended.epochRest, 0];
  required(ended.ending !== NO_MEMORY);
  const run = found(ended);
  return { ...run, outcome: OUTCOMES[ended.ending], end_s, ...statesOf(core.states_pic(...instant), arrays.radii.length, numbers.hasSpins) };
}
export function runPit(arrays, numbers, frames) {
  give(arrays, numbers);
  required(core.begin_pit());
  required(core.advance_pit(frames));
  const run = found(results());
  const { duration, damping, hasSpins } = numbers,
    { positions, velocities, spins } = statesOf(core.states_pit(undamped(damping, duration)), arrays.radii.length, hasSpins),
    left = kept(damping, duration);
  return {
    ...run,
    outcome: "completed",
    end_s: duration,
    frames,
    positions,
    velocities: velocities.map((velocity) => velocity.map((v) => v * left)),
    spins: spins && spins.map((spin) => spin * left),
  };
}
