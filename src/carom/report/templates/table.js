// Lets readers choose a profile in the table of methods, and filter and sort the table of scenes and engines. Without
// JavaScript, both tables are shown completely.
"use strict";
(() => {
  const ORDER = ["exact", "close", "sampled", "inaccurate", "diverged", "diverged-inaccurate", "wrong"]; // CSS classes from best to worst
  const table = document.querySelector("table.grid");
  if (!table) return;
  const head = [...table.tHead.rows[0].cells], scenes = [...table.tBodies[0].rows];
  const columns = head.slice(1).map((cell) => { // a heading of two lines: engine and profile
    const engine = cell.querySelector("b");
    return engine ? [engine.textContent.trim(), cell.lastChild.textContent.trim()] : [cell.textContent.trim()];
  });
  const nameOf = (row) => (row.cells[0].querySelector(".word") ?? row.cells[0]).textContent.trim();
  const groupOf = (row) => (nameOf(row).includes("/") ? nameOf(row).split("/")[0] : "others");
  const rankOf = (cell) => ORDER.findIndex((grade) => cell.classList.contains(grade));
  const distinct = (items) => [...new Set(items)];
  const chosen = {};

  const option = (text) => { const made = document.createElement("option"); made.value = made.textContent = text; return made; };
  const bar = document.createElement("div");
  bar.className = "filters";
  const status = document.createElement("output");
  const ranking = [...document.querySelectorAll("table.methods tbody tr")];
  const engineOf = (row) => row.cells[0].querySelector(".word, b")?.textContent.trim() ?? "";
  const profileOf = (row) => row.cells[0].querySelector(".figure")?.textContent.trim();
  const choice = (name, items) => {
    const label = document.createElement("label"), select = document.createElement("select");
    select.append(option(""), ...items.map(option));
    select.options[0].textContent = "all";
    select.addEventListener("change", () => { chosen[name] = select.value; show(); });
    label.append(`${name} `, select);
    bar.append(label);
    return select;
  };
  choice("engine", distinct(columns.map(([engine]) => engine)));
  const several = (engine) => columns.filter(([other]) => other === engine).length; // the engine with most profiles determines their order
  const inOrder = [...columns].sort(([a], [b]) => several(b) - several(a));
  const only = (engine) => several(engine) === 1; // an engine with one profile, such as PIT, is shown with every profile
  const profiles = distinct(inOrder.map(([, profile]) => profile).filter(Boolean)), select = choice("profile", profiles);
  choice("grade", ORDER.filter((grade) => scenes.some((row) => [...row.cells].some((cell) => cell.classList.contains(grade)))));
  choice("group", distinct(scenes.map(groupOf)));
  bar.append(status);
  table.closest(".scroll").before(bar);

  const radios = ["", ...profiles].map((profile) => {
    const label = document.createElement("label"), radio = document.createElement("input");
    Object.assign(radio, { type: "radio", name: "profile", value: profile, checked: !profile });
    radio.addEventListener("change", () => { select.value = chosen.profile = profile; show(); });
    label.append(radio, profile || "all");
    return label;
  });
  if (profiles.length > 1 && ranking.length) {
    const fieldset = document.createElement("fieldset"), legend = document.createElement("legend");
    fieldset.className = "switch";
    legend.textContent = "Profile:";
    fieldset.append(legend, ...radios);
    ranking[0].closest(".scroll").before(fieldset);
    // Show the default settings first, unless a link leads to another part of the table.
    if (profiles.includes("default") && !location.hash) select.value = chosen.profile = "default";
  }

  const show = () => {
    // Rows and columns that belong to no profile are always shown.
    const kept = columns.map(([engine, profile]) => (!chosen.engine || engine === chosen.engine) && (!chosen.profile || !profile || profile === chosen.profile || only(engine)));
    for (const row of ranking) row.hidden = Boolean(chosen.profile && profileOf(row)) && profileOf(row) !== chosen.profile && !only(engineOf(row));
    for (const { firstChild: radio } of radios) radio.checked = radio.value === (chosen.profile ?? "");
    for (const row of [table.tHead.rows[0], ...scenes]) kept.forEach((keep, k) => { row.cells[k + 1].hidden = !keep; });
    let count = 0;
    for (const row of scenes) {
      const graded = !chosen.grade || kept.some((keep, k) => keep && row.cells[k + 1].classList.contains(chosen.grade));
      row.hidden = !graded || Boolean(chosen.group && groupOf(row) !== chosen.group);
      count += row.hidden ? 0 : 1;
    }
    status.textContent = `${count} of ${scenes.length} scenes`;
  };

  head.forEach((cell, k) => {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "sort";
    button.title = k ? "Sort by grade, or restore the order" : "Sort by name, or restore the order";
    button.append(...cell.childNodes);
    cell.append(button);
    button.addEventListener("click", () => {
      const sorted = cell.ariaSort === null || cell.ariaSort === "none";
      head.forEach((other) => { other.ariaSort = "none"; });
      cell.ariaSort = sorted ? (k ? "descending" : "ascending") : "none";
      const order = !sorted ? scenes : [...scenes].sort((a, b) =>
        k ? rankOf(b.cells[k]) - rankOf(a.cells[k]) : nameOf(a).localeCompare(nameOf(b)));
      table.tBodies[0].append(...order);
    });
  });
  show();
})();
