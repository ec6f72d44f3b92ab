// Starts the core of the page.
import { startCore } from "./wasm_core.js";

await startCore(globalThis.caromUnpacked(document.getElementById("core")));
