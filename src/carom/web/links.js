// Makes two buttons work: one copies a link to the scene, the other saves the scene as a file.
import { copy, problem, save } from "./layout.js";
import { asLink, asToml } from "./scene.js";
import { make } from "./drawing.js";
import { state } from "./state.js";

async function copyLink() {
  const link = location.href.split("#")[0] + `#${asLink(state.scene, state.method)}`;
  try {
    await navigator.clipboard.writeText(link);
    copy.textContent = "copied";
  } catch {
    problem.textContent = link;
  }
}
function download() {
  const url = URL.createObjectURL(new Blob([asToml(state.scene)], { type: "application/toml" }));
  make("a", { href: url, download: "scene.toml" }).click();
  setTimeout(() => URL.revokeObjectURL(url), 1000);
}
copy.onclick = copyLink;
save.onclick = download;
