// The explorer: sliders, the deformed finger on a canvas, its figures and its force over the stroke.
"use strict";
(async () => {
  const byId = (name) => document.getElementById(name);
  const { manifest, load, finger, force, predicted, fault, at } = pinnrayModel;
  const canvas = byId("explorer-canvas");
  if (!canvas.getContext || !("DecompressionStream" in window)) return;
  const mesh = await load();
  byId("explorer-absent").hidden = true;
  byId("explorer").hidden = false;

  const { FOOT, ink, digits, sheet, view, placed, paint, outline, lines, seen, colourBar, scaleBar } = pinnrayBody;
  const element = (name, attributes = {}, text = "") => {
    const made = Object.assign(document.createElement(name), { textContent: text });
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    return made;
  };

  // The sliders: the stroke, the study's parameters, and Young's modulus and depth, which are mere factors.
  const factors = [
    { name: "young", symbol: "E", meaning: "Young's modulus", unit: "MPa", low: 0.1, high: 1000, value: manifest.fixed.young, log: true },
    { name: "depth", meaning: "Depth of the finger", unit: "mm", low: 1, high: 100, value: manifest.fixed.depth, log: true },
  ].filter(({ name }) => !manifest.parameters.some((each) => each.name === name));
  const stroke = { name: "stroke", meaning: "Stroke of the indenter", unit: "mm", low: manifest.stroke / 200, high: manifest.stroke, value: manifest.stroke };
  const controls = [stroke, ...manifest.parameters, ...factors];
  const STEPS = 1000;
  const toStep = ({ low, high, log }, value) => STEPS * (log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low));
  const toValue = ({ low, high, log }, step) => {
    const value = log ? low * (high / low) ** (step / STEPS) : low + ((high - low) * step) / STEPS;
    return Math.min(Math.max(Number(value.toPrecision(4)), low), high);
  };
  const values = { ...manifest.fixed };
  const form = byId("explorer-sliders");
  for (const control of controls) {
    const { name, meaning, unit, symbol, low, high } = control;
    const label = element("label", { for: `slider-${name}` });
    label.append(element("span", {}, `${meaning}${symbol ? `, ${symbol}` : ""}`));
    control.slider = element("input", { id: `slider-${name}`, type: "range", min: 0, max: STEPS, step: 1 });
    control.box = element("input", { type: "number", step: "any", min: low, max: high, "aria-label": `${meaning}, ${unit}`, id: `value-${name}` });
    const row = element("span", { class: "explorer-value" });
    row.append(control.slider, control.box, element("span", { class: "unit" }, unit));
    label.append(row);
    form.append(label);
    control.slider.addEventListener("input", () => set(control, toValue(control, Number(control.slider.value))));
    control.box.addEventListener("change", () => {
      const given = control.box.value.trim() === "" ? NaN : Number(control.box.value);
      set(control, Number.isFinite(given) ? given : values[name]);
    });
  }
  form.addEventListener("submit", (event) => event.preventDefault());

  function show(control) {
    const value = values[control.name];
    control.slider.value = Math.round(toStep(control, value));
    control.slider.setAttribute("aria-valuetext", `${digits(value, 4)} ${control.unit}`);
    control.box.value = value;
  }

  // Why the study says nothing of these values; empty if it does.
  function unknown() {
    const out = controls.find(({ name, low, high }) => !(values[name] >= low && values[name] <= high));
    if (!out) return fault(values);
    return `${out.meaning} of ${digits(values[out.name])} ${out.unit} is outside the study, which has ${digits(out.low)} to ${digits(out.high)} ${out.unit}.`;
  }

  // One finger is computed once for all strokes; a frame is drawn when the browser is ready for it.
  let known, asked;
  function set(control, value) {
    values[control.name] = value;
    show(control);
    if (control !== stroke) known = undefined;
    asked ??= requestAnimationFrame(draw);
  }

  const rows = new Map(manifest.figures.map(({ name, title, unit, meaning }) => {
    const row = element("tr", { title: meaning });
    const head = element("th", { scope: "row" }, title);
    const cells = [element("td", { id: `figure-${name}` }), element("td", { class: "within" })];
    row.append(head, ...cells);
    byId("explorer-figures").tBodies[0].append(row);
    return [name, { cells, unit }];
  }));

  function draw() {
    asked = undefined;
    const started = performance.now();
    const why = unknown();
    byId("explorer-fault").hidden = !why;
    byId("explorer-fault").textContent = why;
    byId("explorer").classList.toggle("unknown", Boolean(why));
    const inside = { ...values };
    for (const { name, low, high } of controls) inside[name] = Math.min(Math.max(values[name], low), high);
    known ??= finger(inside);
    const now = predicted(known, inside.stroke / manifest.stroke);
    for (const { name, value, half } of now.figures) {
      const { cells, unit } = rows.get(name);
      cells[0].textContent = why ? "not known" : `${digits(value)} ${unit}`;
      const least = name === "contact_width" ? Math.max(value - half, 0) : value - half;
      cells[1].textContent = why ? "" : `${digits(least)} to ${digits(value + half)}`;
    }
    picture(now);
    curve(why);
    compareMarkers(now);
    byId("explorer-note").textContent = why ? "" :
      `True scale. Displacement within ${digits(100 * now.error, 2)} % in 19 of 20 cases (root mean square).`;
    byId("explorer-copied").hidden = true;
    byId("explorer").dataset.milliseconds = performance.now() - started;
    state = now;
  }
  let state;

  // The view holds every finger of the ranges: that of the middle at rest, with room for the stroke and cylinder.
  const range = (() => {
    const all = { x: [Infinity, -Infinity], y: [Infinity, -Infinity] };
    for (let n = 0; n < mesh.count; n += 1) {
      for (const [axis, name] of ["x", "y"].entries()) {
        const value = mesh.points[2 * n + axis];
        all[name] = [Math.min(all[name][0], value), Math.max(all[name][1], value)];
      }
    }
    return { x: [all.x[0] - 4, all.x[1] + 6], y: [all.y[0] - 0.75 * manifest.stroke, all.y[1] + 1.2 * manifest.stroke + 4] };
  })();

  function picture({ points, moved, stress, figures }) {
    const width = canvas.clientWidth;
    const scale = width / (range.x[1] - range.x[0]);
    const height = scale * (range.y[1] - range.y[0]);
    canvas.style.height = `${height + FOOT}px`;
    const context = sheet(canvas, width, height + FOOT);
    const middle = { scale, x: (range.x[0] + range.x[1]) / 2, y: (range.y[0] + range.y[1]) / 2 };
    const at = view(middle, [width / 2, height / 2]);
    const { triangles } = mesh;
    const { value: largest } = figures.find(({ name }) => name === "von_mises");
    const most = Math.max(manifest.colourStress * (values.young / manifest.baseYoung), largest);
    const share = (t) => (stress[triangles[3 * t]] + stress[triangles[3 * t + 1]] + stress[triangles[3 * t + 2]]) / (3 * most);
    outline(context, manifest.outlines, placed(points, undefined, at), ink("--rule"));
    const places = placed(points, moved, at);
    paint(context, triangles, places, share, manifest.colours);
    outline(context, manifest.outlines, places, ink("--ink"));
    // The cylinder, and the way of its middle.
    const angle = (values.direction * Math.PI) / 180;
    const start = [values.contact_position, values.radius];
    const end = [start[0] + values.stroke * Math.sin(angle), start[1] - values.stroke * Math.cos(angle)];
    context.strokeStyle = ink("--ink");
    context.fillStyle = ink("--soft");
    context.lineWidth = 1.2;
    context.beginPath();
    context.arc(at.X(end[0]), at.Y(end[1]), values.radius * scale, 0, 2 * Math.PI);
    context.globalAlpha = 0.55;
    context.fill();
    context.globalAlpha = 1;
    context.stroke();
    context.setLineDash([3, 3]);
    lines(context, [start, end], at, ink("--ink"));
    context.setLineDash([]);
    seen(context, markers.map(([x, y, u, v]) => [x + u, y + v]), at);
    const title = width > 430 ? "von Mises stress" : "stress";
    colourBar(context, [8, height], Math.min(0.75 * width, 320), manifest.colours, ["0", `≥ ${digits(most)} MPa`, title]);
    scaleBar(context, [width - 8, height], scale, 0.15 * width);
  }

  // Force over the stroke with its interval; what is beyond the stroke is grey.
  const svg = byId("explorer-curve");
  function curve(why) {
    svg.replaceChildren();
    if (why) return;
    const share = values.stroke / manifest.stroke;
    const strokes = Array.from({ length: 32 }, (_, k) => (k + 1) / 32);
    const points = [{ s: 0, value: 0, half: 0 }, ...strokes.map((s) => ({ s, ...force(known, s) }))];
    const now = force(known, share);
    const most = Math.max(...points.map(({ value, half }) => value + half), 1e-9);
    const step = [1, 2, 5, 10].map((each) => each * 10 ** Math.floor(Math.log10(most / 4))).find((each) => most / each <= 5);
    const high = step * Math.ceil(most / step);
    const X = (s) => 46 + 300 * s;
    const Y = (value) => 172 - 155 * Math.min(Math.max(value / high, 0), 1);
    const line = (list) => list.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join(" ");
    const made = (name, attributes, text) => {
      const node = document.createElementNS("http://www.w3.org/2000/svg", name);
      for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
      if (text !== undefined) node.textContent = text;
      return node;
    };
    const band = [...points.map(({ s, value, half }) => [X(s), Y(value + half)]), ...points.toReversed().map(({ s, value, half }) => [X(s), Y(value - half)])];
    const parts = [
      made("polygon", { points: line(band), class: "band" }),
      made("polyline", { points: line(points.map(({ s, value }) => [X(s), Y(value)])), class: "rest" }),
      made("polyline", { points: line([...points.filter(({ s }) => s < share).map(({ s, value }) => [X(s), Y(value)]), [X(share), Y(now.value)]]), class: "gone" }),
      made("circle", { cx: X(share), cy: Y(now.value), r: 4 }),
      made("path", { d: "M46 12V172H350", class: "axis" }),
      made("text", { x: 198, y: 206, "text-anchor": "middle" }, "stroke, mm"),
      made("text", { x: 12, y: 92, "text-anchor": "middle", transform: "rotate(-90 12 92)" }, "force, N"),
    ];
    for (let value = 0; value <= high * 1.001; value += step) {
      parts.push(made("text", { x: 40, y: Y(value) + 4, "text-anchor": "end" }, digits(value)));
    }
    for (const s of [0, 0.25, 0.5, 0.75, 1]) {
      parts.push(made("text", { x: X(s), y: 188, "text-anchor": "middle" }, digits(s * manifest.stroke)));
    }
    svg.replaceChildren(...parts);
  }

  // Measured markers: where they were seen, and how far the prediction is from there.
  let markers = [];
  const columns = ["x_mm", "y_mm", "u_mm", "v_mm"];
  function readMarkers(text, name) {
    const lines = text.split(/\r?\n/).map((line) => line.trim()).filter((line) => line && !line.startsWith("#"));
    const heads = (lines[0] ?? "").split(",").map((head) => head.trim());
    const places = columns.map((column) => heads.indexOf(column));
    if (places.includes(-1)) {
      return `${name} lacks the column ${columns[places.indexOf(-1)]}; it needs ${columns.join(",")}.`;
    }
    const found = lines.slice(1).map((line) => places.map((place) => Number(line.split(",")[place] || NaN)));
    const seen = found.filter((row) => row.every(Number.isFinite));
    if (!seen.length) return `${name} has no marker with four numbers.`;
    markers = seen;
    return "";
  }

  async function takeFile(file) {
    const said = readMarkers(await file.text(), file.name);
    byId("explorer-said").textContent = said;
    asked ??= requestAnimationFrame(draw);
  }

  function compareMarkers(now) {
    if (!markers.length) return;
    const all = markers.map(([x, y, u, v]) => ({ seen: [u, v], found: at(now, [x, y]) }));
    const inside = all.filter(({ found }) => found);
    const mean = inside.reduce((sum, { seen, found }) => sum + Math.abs(seen[0] - found[0]) + Math.abs(seen[1] - found[1]), 0) / inside.length;
    const outside = all.length - inside.length;
    byId("explorer-markers").textContent = inside.length
      ? `${inside.length} markers: mean of |Δu| + |Δv| ${digits(mean)} mm at these sliders.${outside ? ` ${outside} lie outside the finger.` : ""}`
      : "All markers lie outside the finger; x and y are of the finger at rest, mm from its base on the front face.";
  }

  byId("explorer-csv").addEventListener("change", ({ target }) => target.files[0] && takeFile(target.files[0]));
  const page = byId("explorer");
  page.addEventListener("dragover", (event) => event.preventDefault());
  page.addEventListener("drop", (event) => {
    event.preventDefault();
    if (event.dataTransfer.files[0]) takeFile(event.dataTransfer.files[0]);
  });

  // The same finger for the command line, a file of options, and Python.
  const shapes = () => manifest.shapeNames.concat("contact_position", "depth").filter((name, k, all) => all.indexOf(name) === k);
  const loads = ["stroke", "radius", "direction", "friction", "young", "poisson"];
  const copies = {
    command: () => `pinnray solve fem-nonlinear --design ${manifest.design} --law ${manifest.law} --load cylinder`
      + loads.map((name) => ` --${name} ${values[name]}`).join("")
      + shapes().map((name) => ` --set ${name}=${values[name]}`).join("") + ` --mesh-size ${manifest.meshSize}`,
    toml: () => ["[options]", `design = "${manifest.design}"`, `law = "${manifest.law}"`, 'load = "cylinder"',
      ...loads.map((name) => `${name} = ${values[name]}`), `mesh-size = ${manifest.meshSize}`,
      `set = [${shapes().map((name) => `"${name}=${values[name]}"`).join(", ")}]`, 'solvers = "fem-nonlinear"'].join("\n"),
    python: () => `pr.solve("${manifest.design}", "fem-nonlinear", size=${manifest.meshSize}, load="cylinder", law="${manifest.law}", `
      + [...loads, ...shapes()].map((name) => `${name}=${values[name]}`).join(", ") + ")",
  };
  for (const button of document.querySelectorAll("[data-copy]")) {
    button.addEventListener("click", async () => {
      const text = copies[button.dataset.copy]();
      const shown = byId("explorer-copied");
      shown.textContent = text;
      shown.hidden = false;
      try {
        await navigator.clipboard.writeText(text);
        byId("explorer-said").textContent = "copied";
      } catch {
        byId("explorer-said").textContent = "select and copy it below";
      }
    });
  }

  function middle() {
    for (const control of controls) {
      values[control.name] = control.value;
      show(control);
    }
    known = undefined;
    draw();
  }
  byId("explorer-reset").addEventListener("click", middle);
  new ResizeObserver(() => { asked ??= requestAnimationFrame(draw); }).observe(canvas.parentElement);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  window.pinnrayExplorer = { values, controls, draw, set, state: () => state };
  middle();
})();
