// node bits.mjs FOLDER: for each line of JSON on stdin, a scene and what to solve it by, what the modules of the folder
// make of it: impacts as bodies and the bits of every float, or what of the scene is not known.
import { readFileSync } from "node:fs";
import { createInterface } from "node:readline";
import { pathToFileURL } from "node:url";

const moduleOf = (name) => import(pathToFileURL(`${process.argv[2]}/${name}.js`));
const { startCore } = await moduleOf("wasm_core");
await startCore(readFileSync(`${process.argv[2]}/core.wasm`));
const { pic, pit, refused } = await moduleOf("run_methods");
const { Obstacles } = await moduleOf("obstacles");
const bits = (numbers) => Buffer.from(Float64Array.from(numbers).buffer).toString("hex");
const KINDS = { face: 0, vertex: 1, arc: 2 };
const NO_EDGE = [-1, -1];
const EDGE_KINDS = 4; // of carom/core/pit/chain_distance.h

// The edge that an impact was on, and of which kind; of PIC by the feature that it records; PIT records both.
function edgeOf({ second, at: [[x, y]], feature }, method, { features, outlines }) {
  if (second >= 0 || feature < 0) return NO_EDGE;
  const outline = outlines[-1 - second];
  if (outline === null) return NO_EDGE;
  if (method === "pit") return [Math.floor(feature / EDGE_KINDS), feature % EDGE_KINDS];
  const { edges, kind } = features[feature];
  return [edges.length === 1 ? edges[0] : outline.nearest(x, y, edges).edge, KINDS[kind]];
}

for await (const line of createInterface({ input: process.stdin })) {
  const { scene, method, most } = JSON.parse(line);
  const names = refused(scene);
  if (names.length) {
    console.log(JSON.stringify({ refused: names }));
    continue;
  }
  const run = method === "pic" ? pic(scene, most) : pit(scene);
  const obstacles = new Obstacles(scene.walls, Math.max(...scene.discs.map((d) => d.radius_m)));
  const rows = run.impacts.map((impact) => [impact.time_s, impact.normal, impact.before, impact.after].flat(3));
  const modes = (run.modes ?? []).map((mode) => [
    [mode.impacts, mode.disc, mode.wall, mode.before, mode.after],
    bits([mode.time_s, mode.at, mode.velocity, mode.acceleration, mode.spin, mode.spin_rate].flat()),
  ]);
  console.log(
    JSON.stringify({
      outcome: run.outcome,
      bodies: run.impacts.map(({ first, second }) => [first, second]),
      edges: run.impacts.map((impact) => edgeOf(impact, method, obstacles)),
      floats: rows.map(bits),
      spins: run.spins === null ? null : run.impacts.map((impact) => bits(impact.spins)),
      modes,
      ambiguous: run.ambiguous,
      final: bits([run.positions, run.velocities, run.spins ?? []].flat(2)),
    }),
  );
}
