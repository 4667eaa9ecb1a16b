// What the field viewer draws for one panel: the body in its colours, outlines, markers and the way of the contact.
"use strict";
const pinnrayTraces = (() => {
  const { manifest, kept, values, markers, displacement } = pinnrayFields;
  const ink = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const MEASURED = "#d1006c";

  function shape(solver, load) {
    const { points } = pinnrayFields.mesh;
    const moved = displacement(solver, load);
    const axis = (which) => Array.from({ length: points.length / 2 }, (_, n) => points[2 * n + which] + moved[2 * n + which]);
    return { x: axis(0), y: axis(1) };
  }

  function outline(x, y) {
    const lines = { x: [], y: [], z: [] };
    for (const path of manifest.outlines) {
      for (const node of path) {
        lines.x.push(x[node]);
        lines.y.push(y[node]);
        lines.z.push(0.01);
      }
      for (const axis of Object.values(lines)) axis.push(null);
    }
    return lines;
  }

  // An arrow from where the contact is at rest to where it has come, with a head of a tenth of the finger's height.
  function way({ contact: [start, end] }, load, head) {
    const tip = [0, 1].map((axis) => start[axis] + load * (end[axis] - start[axis]));
    const length = Math.hypot(tip[0] - start[0], tip[1] - start[1]) || 1;
    const [x, y] = [0, 1].map((axis) => (head * (tip[axis] - start[axis])) / length);
    const barb = (turn) => [tip[0] - 0.9 * x + turn * 0.45 * y, tip[1] - 0.9 * y - turn * 0.45 * x];
    return [start, tip, barb(1), tip, barb(-1)];
  }

  // A cross at each place: two strokes, as lines; the letters of a symbol depend on the fonts that there are.
  const crosses = (places, arm) => places.flatMap(([x, y]) =>
    [1, -1].flatMap((turn) => [[x - arm, y - turn * arm], [x + arm, y + turn * arm], [null, null]]));

  const cloud = (places) => ({ x: places.map(([x]) => x), y: places.map(([, y]) => y), z: places.map(() => 0.02) });

  // The scale that a panel's colours have, and whether it is symmetric about zero.
  function scaleOf({ solver, number, against }) {
    const quantity = manifest.quantities[number];
    const high = against ? solver.scales[against][number] : quantity.high;
    return { low: against ? -high : quantity.low, high, signed: Boolean(against) || quantity.signed };
  }

  function traces(panel, load, { scene, bar, head, marks }) {
    const { triangles } = pinnrayFields.mesh;
    const { solver, against } = panel;
    const { x, y } = shape(solver, load);
    const shown = values(panel, load);
    const { low, high, signed } = scaleOf(panel);
    const { unit } = manifest.quantities[panel.number];
    const corner = (k) => kept(`corner ${k}`, () => Array.from({ length: triangles.length / 3 }, (_, t) => triangles[3 * t + k]));
    const font = { color: ink("--ink") };
    const drawn = [
      {
        type: "mesh3d", x, y, z: new Array(x.length).fill(0), i: corner(0), j: corner(1), k: corner(2),
        intensity: shown, intensitymode: "cell", flatshading: true, hoverinfo: "none",
        cmin: low, cmax: high, colorscale: signed ? manifest.differences : "Viridis",
        lighting: { ambient: 1, diffuse: 0, specular: 0, fresnel: 0, roughness: 1 },
        colorbar: {
          orientation: "h", yanchor: "top", y: -0.02, thickness: 12, outlinewidth: 0, ...bar,
          tickfont: font, nticks: 6, exponentformat: "power",
          title: { text: `${against ? "difference, " : ""}${unit}`, side: "bottom", font },
        },
      },
      { type: "scatter3d", mode: "lines", ...outline(x, y), line: { color: ink("--ink"), width: 1.5 } },
      { type: "scatter3d", mode: "lines", line: { color: ink("--muted"), width: 1 }, opacity: 0.5, ...kept("rest", () => {
        const rest = shape(solver, 0);
        return outline(rest.x, rest.y);
      }) },
    ];
    if (marks) {
      const marker = { symbol: "circle-open", size: 7, color: MEASURED, line: { width: 2, color: MEASURED } };
      drawn.push({ type: "scatter3d", mode: "markers", ...cloud(solver.observed), marker });
      for (const lines of [crosses(markers(solver, load), 0.13 * head), way(solver, load, head)]) {
        drawn.push({ type: "scatter3d", mode: "lines", ...cloud(lines), line: { color: ink("--ink"), width: 4 } });
      }
    }
    for (const each of drawn) Object.assign(each, { scene, hoverinfo: each.hoverinfo ?? "skip" });
    return { drawn, shown, x, y };
  }

  return { traces, shape, way, scaleOf, ink };
})();
