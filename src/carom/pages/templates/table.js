// Filters and sorting of the table of every scene on every engine. Without it the table stands whole.
"use strict";
(() => {
  const ORDER = ["exact", "close", "sampled", "inaccurate", "parted", "parted-inaccurate", "wrong"]; // from best to worst, by class
  const table = document.querySelector("table.grid");
  if (!table) return;
  const head = [...table.tHead.rows[0].cells], scenes = [...table.tBodies[0].rows];
  const columns = head.slice(1).map((cell) => cell.innerText.split("\n").map((line) => line.trim()));
  const nameOf = (row) => (row.cells[0].querySelector(".word") ?? row.cells[0]).textContent.trim();
  const groupOf = (row) => (nameOf(row).includes("/") ? nameOf(row).split("/")[0] : "others");
  const rankOf = (cell) => ORDER.findIndex((grade) => cell.classList.contains(grade));
  const distinct = (items) => [...new Set(items)];
  const chosen = {};

  const option = (text) => { const made = document.createElement("option"); made.value = made.textContent = text; return made; };
  const bar = document.createElement("div");
  bar.className = "filters";
  const status = document.createElement("output");
  const choice = (name, items) => {
    const label = document.createElement("label"), select = document.createElement("select");
    select.append(option(""), ...items.map(option));
    select.options[0].textContent = "all";
    select.addEventListener("change", () => { chosen[name] = select.value; show(); });
    label.append(`${name} `, select);
    bar.append(label);
  };
  choice("engine", distinct(columns.map(([engine]) => engine)));
  choice("profile", distinct(columns.map(([, profile]) => profile)));
  choice("grade", ORDER.filter((grade) => scenes.some((row) => [...row.cells].some((cell) => cell.classList.contains(grade)))));
  choice("group", distinct(scenes.map(groupOf)));
  bar.append(status);
  table.closest(".scroll").before(bar);

  const show = () => {
    const kept = columns.map(([engine, profile]) => (!chosen.engine || engine === chosen.engine) && (!chosen.profile || profile === chosen.profile));
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
    button.title = k ? "Sort: the worst first, and back" : "Sort by name, and back";
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
