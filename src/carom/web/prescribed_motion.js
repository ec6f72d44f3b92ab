// Paths of driven bodies as legs (parts with constant velocity), as in carom/model/prescribed_motion.py.
import { less, nearest, plus, rational, times } from "./rational.js";

const NO_WAY = [0, 0];
// Returns the legs of a body: start time, end time, displacement at the start time, and velocity.
export function legsOf({ legs = [], velocity_m_s = NO_WAY }) {
  const given = legs.length ? legs : [{ from_s: 0, velocity_m_s }];
  let at = [0, 0].map(rational);
  return given.map(({ from_s: begin, velocity_m_s: velocity }, k) => {
    const end = given[k + 1]?.from_s ?? Infinity,
      moved = at.map(nearest);
    if (end < Infinity) {
      const lasts = less(rational(end), rational(begin));
      at = at.map((x, axis) => plus(x, times(lasts, rational(velocity[axis]))));
    }
    return { begin, end, moved, velocity };
  });
}
export const isDriven = (legs) => legs.some(({ velocity }) => velocity.some((v) => v !== 0));
export const movedOn = ({ begin, moved, velocity }, t) => moved.map((x, k) => x + velocity[k] * (t - begin));
// Returns the leg at a time and all later legs.
export const legsFrom = (legs, t) => {
  let first = legs.length - 1;
  while (first > 0 && legs[first].begin > t) first--;
  return first ? legs.slice(first) : legs;
};
