// Starts the core of the page.
import { startCore } from "./core.js";

await startCore(globalThis.caromUnpacked(document.getElementById("core")));
