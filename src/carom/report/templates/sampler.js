// Runs PIT for two discs, with a step size that the reader chooses. Their only impact is computed by a formula.
const pairAt = (discs, t) => discs.map(({ position_m: p, velocity_m_s: v }) => [p[0] + v[0] * t, p[1] + v[1] * t]);
const difference = ([a, b]) => [b[0] - a[0], b[1] - a[1]];
const product = (a, b) => a[0] * b[0] + a[1] * b[1];
const collided = ({ discs, restitution }, time_s) => {
  const at = pairAt(discs, time_s), before = discs.map((d) => d.velocity_m_s), way = difference(at), away = Math.sqrt(product(way, way));
  const normal = [way[0] / away, way[1] / away], ease = discs.map((d) => (d.mass_kg === "inf" ? 0 : 1 / d.mass_kg));
  const push = ((1 + restitution) * product(normal, difference(before))) / (ease[0] + ease[1]);
  const after = before.map((v, k) => v.map((x, axis) => x + (k ? -1 : 1) * push * ease[k] * normal[axis]));
  return { time_s, first: 0, second: 1, at, normal, before, after };
};
const sampledPair = (thrown, dt) => {
  const { discs, duration_s } = thrown, reach = discs[0].radius_m + discs[1].radius_m, u = difference(discs.map((d) => d.velocity_m_s));
  const way = difference(pairAt(discs, 0)), b = product(way, u), c = product(way, way) - reach * reach;
  const exact = collided(thrown, Math.max(0, c / (Math.sqrt(Math.max(0, b * b - product(u, u) * c)) - b)));
  const impacts = [];
  for (let k = 0; !impacts.length && k * dt < duration_s * (1 - 1e-12); k++) {
    const there = difference(pairAt(discs, k * dt));
    if (product(there, u) < 0 && product(there, there) <= reach * reach) impacts.push(collided(thrown, k * dt));
  }
  const last = impacts[0] ?? { time_s: 0, at: pairAt(discs, 0), after: discs.map((d) => d.velocity_m_s) };
  const positions = last.at.map((p, k) => p.map((x, axis) => x + last.after[k][axis] * (duration_s - last.time_s)));
  return { exact, seen: { impacts, positions, end_s: duration_s, modes: null } };
};
const sampledEvery = (scene, run, dt) => {
  const thrown = run.sampler, { exact, seen } = sampledPair(thrown, dt), [found] = seen.impacts;
  const off = (i) => {
    const [v, w] = [(found ?? exact).after[i], exact.after[i]];
    return Math.abs(Math.atan2(v[0] * w[1] - v[1] * w[0], v[0] * w[0] + v[1] * w[1]) * 180) / Math.PI;
  };
  const ms = (t) => digits(1000 * t), met = exact.time_s, overlap = overlapOf(thrown, exact), step = `With a step of ${ms(dt)} ms`;
  const late = found ? Math.max(found.time_s - met, 0) : 0;
  const row = {
    bodies: [0, 1], pair: run.impacts[0].pair, true: met, at: 0, reported: found ? found.time_s : null,
    flag: !found ? "missed" : late > 0 ? "late" : "found", became: found ? `${ms(late)} ms late` : "missed", cause: "",
  };
  const said = found
    ? `${step}, the impact is found ${ms(late)} ms late, and a disc leaves in a direction that is wrong by ${digits(Math.max(off(0), off(1)), 2)}°.`
    : `${step}, no frame is within the ${ms(overlap / 2)} ms in which the discs overlap while approaching, so the impact is missed.`;
  const moment = found ? found.time_s : Math.min(met + Math.min(overlap, 2 * dt) / 2, scene.duration);
  return { ...run, dt, end: scene.duration, tracks: tracksOf(thrown, seen), impacts: [row], fault: { row: 0, said, moment } };
};
