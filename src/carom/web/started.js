// The core of the page, started before anything is solved.
import { startCore } from "./core.js";

await startCore(globalThis.caromUnpacked(document.getElementById("core")));
