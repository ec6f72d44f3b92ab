// node bits.mjs FOLDER: for each line of JSON on stdin, a scene and what to solve it by, what the modules of the folder
// make of it: impacts as bodies and the bits of every float, or what of the scene is not ported.
import { createInterface } from "node:readline";
import { pathToFileURL } from "node:url";

const { pic, pit, refused } = await import(pathToFileURL(`${process.argv[2]}/index.js`));
const bits = (numbers) => Buffer.from(Float64Array.from(numbers).buffer).toString("hex");

for await (const line of createInterface({ input: process.stdin })) {
  const { scene, method, most } = JSON.parse(line);
  const names = refused(scene);
  if (names.length) {
    console.log(JSON.stringify({ refused: names }));
    continue;
  }
  const run = method === "pic" ? pic(scene, most) : pit(scene);
  const rows = run.impacts.map((impact) => [impact.time_s, impact.normal, impact.before, impact.after].flat(3));
  const modes = (run.modes ?? []).map((mode) => [
    [mode.impacts, mode.disc, mode.wall, mode.before, mode.after],
    bits([mode.time_s, mode.at, mode.velocity, mode.acceleration, mode.spin, mode.spin_rate].flat()),
  ]);
  console.log(
    JSON.stringify({
      outcome: run.outcome,
      bodies: run.impacts.map(({ first, second }) => [first, second]),
      edges: run.impacts.map(({ edge }) => edge),
      floats: rows.map(bits),
      spins: run.spins === null ? null : run.impacts.map((impact) => bits(impact.spins)),
      modes,
      final: bits([run.positions, run.velocities, run.spins ?? []].flat(2)),
    }),
  );
}
