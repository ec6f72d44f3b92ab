// Tables whose rows are only unpacked when a reader opens them. Their content is inserted as text, never as HTML.
"use strict";
(() => {
  const make = (name, css, ...children) => {
    const element = document.createElement(name);
    if (css) element.className = css;
    element.append(...children);
    return element;
  };
  // Builds the same elements as the macro `content` of page.html.j2.
  const content = ({ text, symbol, note }) => {
    if (!symbol && !note) return [text];
    const sign = make("span", "", symbol ?? "");
    sign.ariaHidden = "true";
    const word = make("span", "word", ...(symbol ? [sign, " ", text] : [text]));
    return note ? [word, make("span", "figure", note)] : [word];
  };
  const shown = ({ columns, rows }, label, css) => {
    const heads = columns.map(([head, number]) => {
      const cell = make("th", number ? "number" : "", head);
      cell.scope = "col";
      return cell;
    });
    const body = rows.map((row) => make("tr", "", ...row.map((said, k) => {
      const cell = typeof said === "string" ? { text: said } : said;
      const made = make(k ? "td" : "th", [cell.css, columns[k][1] ? "number" : ""].filter(Boolean).join(" "), ...content(cell));
      if (k) made.dataset.head = columns[k][0]; else made.scope = "row";
      if (cell.title) made.title = cell.title;
      return made;
    })));
    const scroll = make("div", "scroll", make("table", `${css} cards`, make("thead", "", make("tr", "", ...heads)), make("tbody", "", ...body)));
    scroll.tabIndex = 0;
    scroll.role = "region";
    scroll.ariaLabel = label;
    return scroll;
  };

  for (const details of document.querySelectorAll("details.packed")) {
    const block = details.querySelector("script");
    details.addEventListener("toggle", async () => {
      try {
        block.replaceWith(shown(await unpack(block.textContent), block.dataset.label, block.dataset.css));
      } catch (error) {
        block.replaceWith(make("p", "note", `These rows can't be unpacked (${error}). The file results.jsonl next to this page has the numbers.`));
      }
    }, { once: true });
  }
})();
