// PIT of two discs that fly freely, at a step of the reader's: the first look that finds them approaching in overlap.
const sampledEvery = (scene, run, dt) => {
  const { restitution, velocity, inverse_mass } = run.sampler, [[one], [other]] = scene.discs, { pair } = run.impacts[0];
  const begun = scene.reference.map(([, xs, ys]) => [xs[0], ys[0]]), end = scene.duration, [[met]] = scene.impacts;
  const at = (i, t) => [0, 1].map((k) => begun[i][k] + t * velocity[i][k]);
  const apart = (t) => [0, 1].map((k) => at(1, t)[k] - at(0, t)[k]);
  const passing = [0, 1].map((k) => velocity[1][k] - velocity[0][k]), dot = ([a, b], [c, d]) => a * c + b * d;
  // Newton's law along the line of centres at a time.
  const bounced = (t) => {
    const line = apart(t), impulse = (-(1 + restitution) * dot(passing, line)) / (dot(line, line) * (inverse_mass[0] + inverse_mass[1]));
    return velocity.map((v, i) => v.map((x, k) => x + (i ? 1 : -1) * impulse * inverse_mass[i] * line[k]));
  };
  const looks = [...Array(Math.ceil(end / dt - 1e-9) + 1).keys()].map((k) => Math.min(k * dt, end));
  const found = looks.find((t) => Math.hypot(...apart(t)) <= one + other && dot(apart(t), passing) < 0);
  const after = found === undefined ? velocity : bounced(found), turned = found ?? end;
  const tracks = begun.map((_, i) => [
    [0, turned, end],
    ...[0, 1].map((k) => [begun[i][k], at(i, turned)[k], at(i, turned)[k] + (end - turned) * after[i][k]]),
  ]);
  const off = after.map((v, i) => {
    const w = bounced(met)[i];
    return Math.abs(Math.atan2(v[0] * w[1] - v[1] * w[0], dot(v, w)) * 180) / Math.PI;
  });
  const ms = (t) => digits(1000 * t), overlap = scene.meetings[0][2], missed = found === undefined;
  const late = missed ? 0 : Math.max(found - met, 0), step = `At a step of ${ms(dt)} ms`;
  const row = {
    bodies: [0, 1], pair, true: met, at: 0, reported: missed ? null : found,
    flag: missed ? "missed" : late > 0 ? "late" : "found", became: missed ? "missed" : `${ms(late)} ms late`, cause: "",
  };
  const said = missed
    ? `${step} no look falls into the ${ms(overlap / 2)} ms in which they approach in overlap: missed.`
    : `${step} it is found ${ms(late)} ms late, and a disc leaves ${digits(Math.max(...off), 2)}° off.`;
  const moment = missed ? Math.min(met + Math.min(overlap, 2 * dt) / 2, end) : found;
  return { ...run, dt, end, tracks, impacts: [row], fault: { row: 0, said, moment } };
};
