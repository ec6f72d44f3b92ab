// node play.mjs SOURCES BLOCK: answers each line of JSON on stdin with one: a packed block, or a link of the page.
// Whatever the page would show as a sentence is the field `said`.
import { readFileSync } from "node:fs";
import { createInterface } from "node:readline";
import { pathToFileURL } from "node:url";

const sources = process.argv[2];
const moduleOf = (name) => import(pathToFileURL(`${sources}/${name}.js`));
const element = { textContent: process.argv[3] }; // as the loader starts it unpacks a style and a script
globalThis.document = { getElementById: () => element, createElement: () => ({}), head: { append() {} } };
new Function(readFileSync(`${sources}/unpack_blocks.js`, "utf8"))();
const { startCore } = await moduleOf("wasm_core");
await startCore(readFileSync(`${sources}/core.wasm`));
const { pic } = await moduleOf("run_methods");
const { asLink, asToml, bare, ofLink, pitOf, problemOf } = await moduleOf("scene");
const SHOWN = [RangeError, SyntaxError, TypeError, DOMException]; // what `follow` and `shown` of page.js turn into a sentence

const runsOf = (scene) => [pic(bare(scene), 5000), pitOf(scene)];
const acts = {
  unpack: ({ text }) => ({ text: globalThis.caromText({ textContent: text }) }),
  link: ({ text }) => {
    const { scene, method } = ofLink(text),
      again = ofLink(asLink(scene, method)),
      lost = JSON.stringify(again) === JSON.stringify({ scene, method }) ? "" : "its own link is another scene";
    return { lost, toml: asToml(scene), problem: problemOf(scene) || (runsOf(scene), "") };
  },
};
for await (const line of createInterface({ input: process.stdin })) {
  const asked = JSON.parse(line);
  let answer;
  try {
    answer = await acts[asked.do](asked);
  } catch (error) {
    answer = { said: String(error.message ?? error), lost: SHOWN.some((kind) => error instanceof kind) ? "" : `${error}` };
  }
  console.log(JSON.stringify(answer));
}
