globalThis.caromUnpacked = async (element) => {
  const bytes = Uint8Array.from(atob(element.textContent.trim()), (c) => c.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
};
globalThis.caromUnpacked(document.getElementById("page")).then((text) => {
  const script = document.createElement("script");
  script.type = "module";
  script.textContent = text; // the policy of the page has its hash
  document.head.append(script);
});
