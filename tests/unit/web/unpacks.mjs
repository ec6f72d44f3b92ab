// node unpacks.mjs LOADER: the bytes, in hexadecimal, of each block of a page that is a line on stdin.
import { readFileSync } from "node:fs";

const page = { textContent: "" };
globalThis.document = { getElementById: () => page, createElement: () => ({}), head: { append() {} } };
const blocks = readFileSync(0, "latin1").split("\n").filter((line) => line);
page.textContent = blocks[0]; // as the loader is started, it unpacks the page's script
new Function(readFileSync(process.argv[2], "utf8"))();
for (const block of blocks) console.log(Buffer.from(globalThis.caromUnpacked({ textContent: block })).toString("hex"));
