// Tables: heads that sort, and copies as CSV and as LaTeX. A page without scripts has the plain tables.
"use strict";
(() => {
  const ascii = (text) => text.replace(/−/g, "-").replace(/[\u00a0\u202f]/g, " ").replace(/\s+/g, " ").trim();
  const words = (cell) => ascii(cell.dataset.text ?? cell.innerText ?? "").replace(/ [↑↓↕]$/, "");

  // The words of every column's heads, group and name, from however many head rows there are.
  function headings(table) {
    const names = [];
    for (const row of table.tHead.rows) {
      let column = 0;
      for (const cell of row.cells) {
        for (let span = 0; span < cell.colSpan; span += 1, column += 1) {
          names[column] = [names[column], words(cell)].filter(Boolean).join(", ");
        }
      }
    }
    return names;
  }

  const rowsOf = (table) => [...table.tBodies].flatMap((body) => [...body.rows].map((row) => [...row.cells].map(words)));
  const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text);

  // Numbers after ± have a column of their own, so that a spreadsheet reads both.
  function csv(table) {
    const rows = rowsOf(table);
    const names = headings(table);
    const split = names.map((_, column) => rows.some((row) => (row[column] ?? "").includes("±")));
    const line = (cells) => cells.map(quoted).join(",");
    const head = names.flatMap((name, column) => (split[column] ? [name, `${name} ±`] : [name]));
    const body = rows.map((row) =>
      row.flatMap((text, column) => {
        const [value, error = ""] = text.split("±").map((part) => part.trim());
        return split[column] ? [value, error] : [text === "–" ? "" : text];
      }));
    return [head, ...body].map(line).join("\n") + "\n";
  }

  const special = {
    "\\": "\\textbackslash{}", "%": "\\%", "&": "\\&", "#": "\\#", _: "\\_", $: "\\$", "{": "\\{", "}": "\\}",
    "±": "$\\pm$", "–": "--", "†": "$^\\dagger$", "²": "$^2$", "Δ": "$\\Delta$", "ε": "$\\varepsilon$",
    "σ": "$\\sigma$", "~": "\\textasciitilde{}", "^": "\\textasciicircum{}", "|": "$|$",
  };
  const tex = (text) => text.replace(/(^|\s)-(?=[\d.])/g, "$1$-$").replace(/[\\%&#_{}±–†²Δεσ~^|]/g, (sign) => special[sign]);

  function latex(table) {
    const names = headings(table);
    const line = (cells) => `  ${cells.map(tex).join(" & ")} \\\\`;
    return [
      "% needs \\usepackage{booktabs}",
      `\\begin{tabular}{l${"r".repeat(names.length - 1)}}`,
      "  \\toprule", line(names), "  \\midrule", ...rowsOf(table).map(line), "  \\bottomrule",
      "\\end{tabular}",
    ].join("\n") + "\n";
  }

  async function copy(text) {
    try {
      await navigator.clipboard.writeText(text);
    } catch { // a page that the browser does not trust with the clipboard
      const area = document.createElement("textarea");
      area.value = text;
      document.body.append(area);
      area.select();
      const done = document.execCommand("copy");
      area.remove();
      if (!done) throw new Error("the browser lets no page copy");
    }
  }

  const number = (text) => {
    const found = /^(?:[<>] )?([+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?)/i.exec(text);
    return found ? parseFloat(found[1]) * (/ times$/.test(text) ? 100 : 1) : NaN; // the others are in per cent
  };

  function compare(a, b) {
    const [first, second] = [number(a), number(b)];
    if (!Number.isNaN(first) && !Number.isNaN(second)) return first - second;
    return a.localeCompare(b);
  }

  // Sorts each body; names of groups and rows of the paper stay. Cells without a value come last either way.
  function sort(table, column, head) {
    const falling = head.getAttribute("aria-sort") === "ascending";
    for (const cell of table.tHead.querySelectorAll("[aria-sort]")) cell.setAttribute("aria-sort", "none");
    head.setAttribute("aria-sort", falling ? "descending" : "ascending");
    const empty = (text) => text === "" || text === "–";
    for (const body of table.tBodies) {
      const moved = [...body.rows].filter((row) => !row.matches(".group, .printed"));
      const rows = moved.map((row) => [words(row.cells[column]), row]);
      rows.sort(([a], [b]) => empty(a) - empty(b) || (empty(a) ? 0 : compare(a, b) * (falling ? -1 : 1)));
      body.append(...rows.map(([, row]) => row));
    }
  }

  function button(text, label, act) {
    const made = document.createElement("button");
    made.type = "button";
    made.textContent = text;
    if (label) made.setAttribute("aria-label", label);
    made.addEventListener("click", act);
    return made;
  }

  for (const table of document.querySelectorAll(".scroll > table")) {
    const head = table.tHead.rows[table.tHead.rows.length - 1];
    [...head.cells].forEach((cell, column) => {
      if (cell.colSpan > 1) return;
      const sorter = button("", "", () => sort(table, column, cell));
      sorter.className = "sort";
      sorter.append(...cell.childNodes);
      cell.append(sorter);
      cell.setAttribute("aria-sort", "none");
    });
    const name = table.caption?.innerText ?? "table";
    const said = document.createElement("span");
    said.setAttribute("role", "status");
    const tools = document.createElement("div");
    tools.className = "tools";
    for (const [kind, made] of [["CSV", csv], ["LaTeX", latex]]) {
      tools.append(button(kind, `Copy as ${kind}: ${name}`, async () => {
        try {
          await copy(made(table));
          said.textContent = `copied as ${kind}`;
        } catch (error) {
          said.textContent = String(error.message);
        }
      }));
    }
    tools.prepend("Copy as ");
    tools.append(said);
    table.parentElement.after(tools);
  }

  // A table that is wider than its window says so, and can be scrolled by keys.
  const widths = new ResizeObserver((found) => {
    for (const { target } of found) {
      const cut = target.scrollWidth > target.clientWidth + 1;
      target.classList.toggle("cut", cut);
      if (cut) target.tabIndex = 0;
      else target.removeAttribute("tabindex");
    }
  });
  for (const window of document.querySelectorAll(".scroll")) widths.observe(window);

  for (const image of document.querySelectorAll(".pictures img")) {
    image.addEventListener("click", () => image.parentElement.classList.toggle("wide"));
  }

  window.pinnrayTables = { csv, latex };
  addEventListener("beforeprint", () => {
    for (const part of document.querySelectorAll("details")) part.open = true;
  });
})();
