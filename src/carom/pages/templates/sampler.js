// PIT of two discs that fly freely, at a step of the reader's, by the port that the page of `carom play` has.
const sampledEvery = (scene, run, dt) => {
  const thrown = run.sampler, exact = solvePic(thrown).impacts[0], seen = solvePit(thrown, 1 / dt), [found] = seen.impacts;
  const off = (i) => {
    const [v, w] = [(found ?? exact).after[i], exact.after[i]];
    return Math.abs(Math.atan2(v[0] * w[1] - v[1] * w[0], v[0] * w[0] + v[1] * w[1]) * 180) / Math.PI;
  };
  const ms = (t) => digits(1000 * t), met = exact.time_s, overlap = overlapOf(thrown, exact), step = `At a step of ${ms(dt)} ms`;
  const late = found ? Math.max(found.time_s - met, 0) : 0;
  const row = {
    bodies: [0, 1], pair: run.impacts[0].pair, true: met, at: 0, reported: found ? found.time_s : null,
    flag: !found ? "missed" : late > 0 ? "late" : "found", became: found ? `${ms(late)} ms late` : "missed", cause: "",
  };
  const said = found
    ? `${step} it is found ${ms(late)} ms late, and a disc leaves ${digits(Math.max(off(0), off(1)), 2)}° off.`
    : `${step} no look falls into the ${ms(overlap / 2)} ms in which they approach in overlap: missed.`;
  const moment = found ? found.time_s : Math.min(met + Math.min(overlap, 2 * dt) / 2, scene.duration);
  return { ...run, dt, end: scene.duration, tracks: tracksOf(thrown, seen), impacts: [row], fault: { row: 0, said, moment } };
};
