// Tooltips for the points of a diagram. A tooltip shows the table row to which the point links.
"use strict";
(() => {
  const NEAR = 4, REACH = 12; // in pixels: points nearer than NEAR look like one point; the pointer selects a point within REACH
  const tip = document.createElement("div");
  tip.className = "tip";
  tip.id = "tip";
  tip.setAttribute("role", "tooltip");
  tip.hidden = true;
  document.body.append(tip);

  const rowOf = (link) => document.getElementById(link.getAttribute("href").slice(1))?.closest("tr");
  const middle = (link) => { const box = link.getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2]; };
  const make = (name, text) => { const made = document.createElement(name); made.textContent = text; return made; };

  const distance = (link, x, y) => { const [a, b] = middle(link); return Math.hypot(a - x, b - y); };
  const nearest = (links, x, y) => { // the nearest of several overlapping points
    const found = links.map((link) => [distance(link, x, y), link]).reduce((best, one) => (one[0] < best[0] ? one : best), [REACH, null]);
    return found[1];
  };

  const show = (link, all) => {
    const row = rowOf(link);
    if (!row) return;
    const heads = [...row.closest("table").tHead.rows[0].cells].map((cell) => cell.textContent.trim());
    const said = document.createElement("dl");
    [...row.cells].forEach((cell, k) => {
      const text = cell.textContent.trim();
      if (k && text) said.append(make("dt", heads[k]), make("dd", text));
    });
    const [x, y] = middle(link);
    const others = all.filter((other) => other !== link && distance(other, x, y) < NEAR);
    tip.replaceChildren(make("b", row.cells[0].textContent.trim()), said);
    if (others.length) tip.append(make("p", `at the same place: ${others.map((other) => rowOf(other)?.cells[0].textContent.trim()).join(", ")}`));
    tip.hidden = false;
    link.setAttribute("aria-describedby", tip.id);
    const { width, height } = tip.getBoundingClientRect(), gap = 14;
    tip.style.left = `${Math.max(4, x + gap + width < innerWidth ? x + gap : x - gap - width)}px`;
    tip.style.top = `${Math.max(4, Math.min(y + gap, innerHeight - height - 4))}px`;
  };
  const hide = () => { tip.hidden = true; };
  addEventListener("keydown", (event) => { if (event.key === "Escape") hide(); });
  addEventListener("scroll", hide, { capture: true, passive: true });

  for (const drawing of document.querySelectorAll(".charts svg")) {
    const links = [...drawing.querySelectorAll("a[href^='#']")];
    drawing.addEventListener("pointermove", ({ clientX, clientY }) => {
      const link = nearest(links, clientX, clientY);
      if (link) show(link, links); else hide();
    });
    drawing.addEventListener("pointerleave", hide);
    drawing.addEventListener("click", (event) => {
      const link = event.detail && nearest(links, event.clientX, event.clientY); // `detail` is 0 if the Enter key caused the event
      if (!link) return;
      event.preventDefault();
      location.hash = link.getAttribute("href");
    });
    links.forEach((link, k) => {
      link.setAttribute("tabindex", k ? -1 : 0); // the tab key stops once per diagram; arrow keys move between points
      link.addEventListener("focus", () => show(link, links));
      link.addEventListener("blur", hide);
      link.addEventListener("keydown", (event) => {
        const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
        const next = links[k + step];
        if (!next) return;
        event.preventDefault();
        link.setAttribute("tabindex", -1);
        next.setAttribute("tabindex", 0);
        next.focus({ preventScroll: true });
      });
    });
  }
})();
