// The field viewer: one canvas for solver x quantity x field or difference, and the body along the load.
// Numbers come packed in the page (viewer_fields.js), and so does Plotly.js, unpacked when the viewer is first in sight.
"use strict";
(() => {
  const byId = (name) => document.getElementById(name);
  const box = byId("viewer");
  if (!box) return;
  const canvas = byId("viewer-canvas");
  const { manifest, unpacked, kept, field, difference, displacement } = pinnrayFields;
  let points, triangles;
  const chosen = (name) => byId(name)?.value;

  function state() {
    const solver = manifest.solvers[chosen("viewer-solver")];
    const number = Number(chosen("viewer-quantity"));
    const minus = chosen("viewer-show") === "difference" && !solver.isReference;
    return { solver, number, quantity: manifest.quantities[number], minus, load: Number(chosen("viewer-load")) / 100 };
  }

  const digits = (value) => String(Number(value.toPrecision(3))).replace("-", "−");

  function shape({ solver, load }) {
    const moved = displacement(solver, load);
    const x = [];
    const y = [];
    for (let node = 0; node < points.length / 2; node += 1) {
      x.push(points[2 * node] + moved[2 * node]);
      y.push(points[2 * node + 1] + moved[2 * node + 1]);
    }
    return { moved, x, y };
  }

  // The colours of the displacement follow the load; those of stress and strain are of the full load.
  function colours(now, moved) {
    if (now.minus) return difference(now.solver, now.number);
    if (now.number !== 0 || now.load === 1) return field(now.solver, now.number);
    const size = (node) => Math.hypot(moved[2 * node], moved[2 * node + 1]);
    const found = new Float64Array(triangles.length / 3);
    for (let t = 0; t < found.length; t += 1) {
      found[t] = (size(triangles[3 * t]) + size(triangles[3 * t + 1]) + size(triangles[3 * t + 2])) / 3;
    }
    return found;
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

  const ink = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  let shown;

  function traces(now) {
    const { moved, x, y } = shape(now);
    const { solver, quantity, minus } = now;
    const values = colours(now, moved);
    const scale = minus ? solver.fields[now.number].scale : quantity.high;
    shown = { values, x, y, minus, unit: quantity.unit };
    const corner = (k) => Array.from({ length: triangles.length / 3 }, (_, t) => triangles[3 * t + k]);
    return [
      {
        type: "mesh3d", x, y, z: new Array(x.length).fill(0),
        i: kept("i", () => corner(0)), j: kept("j", () => corner(1)), k: kept("k", () => corner(2)),
        intensity: values, intensitymode: "cell", flatshading: true, hoverinfo: "none",
        cmin: minus ? -scale : quantity.low, cmax: scale,
        colorscale: minus || quantity.signed ? manifest.differences : "Viridis",
        lighting: { ambient: 1, diffuse: 0, specular: 0, fresnel: 0, roughness: 1 },
        colorbar: {
          orientation: "h", y: -0.02, yanchor: "top", len: 0.7, thickness: 12, outlinewidth: 0,
          tickfont: { color: ink("--ink") }, nticks: 6, exponentformat: "power",
          title: { text: `${minus ? "difference, " : ""}${quantity.unit}`, side: "bottom", font: { color: ink("--ink") } },
        },
      },
      { type: "scatter3d", mode: "lines", ...outline(x, y), line: { color: ink("--ink"), width: 1.5 }, hoverinfo: "skip" },
      { type: "scatter3d", mode: "lines", ...kept("rest", () => {
        const [left, right] = [0, 1].map((axis) => Array.from({ length: points.length / 2 }, (_, n) => points[2 * n + axis]));
        return outline(left, right);
      }), line: { color: ink("--muted"), width: 1 }, opacity: 0.5, hoverinfo: "skip" },
    ];
  }

  // What the numbers mean, beside the canvas; the page's words for those who do not see it.
  function describe(now) {
    const { solver, quantity, minus, load } = now;
    const scale = minus ? `±${digits(solver.fields[now.number].scale)}` : `${digits(quantity.low)} to ${digits(quantity.high)}`;
    const own = minus ? "a scale of its own" : "one scale for all solvers";
    byId("viewer-title").textContent =
      `${quantity.title}, ${quantity.unit}: ${solver.label}${minus ? ` minus ${manifest.reference}` : ""}`;
    const late = load < 1 && (minus || now.number !== 0) ? " Colours are those of the full load." : "";
    byId("viewer-note").textContent =
      `Colours: ${scale} ${quantity.unit}, ${own}; values beyond take the end colours. ` +
      `Shape at ${Math.round(100 * load)} % of the load, displacement at true scale: ${solver.path}.${late}` +
      (chosen("viewer-show") === "difference" && solver.isReference ? ` ${solver.label} is what the others are compared with.` : "");
  }

  // View: `range` are the data's limits; the scene scales them to `size`, which zooms, around the camera's centre.
  let range, whole, size, centre;

  function fit() {
    const all = manifest.solvers.flatMap((solver) => [0, 1].map((load) => shape({ solver, load })));
    const limits = (axis) => [
      Math.min(...all.map((one) => one[axis].reduce((a, b) => Math.min(a, b)))),
      Math.max(...all.map((one) => one[axis].reduce((a, b) => Math.max(a, b)))),
    ];
    range = { x: limits("x"), y: limits("y") };
  }

  const span = (axis) => range[axis][1] - range[axis][0];

  // The whole body in the canvas, above the colour bar: an orthographic camera shows a height of about 2.4.
  function showAll() {
    const [wide, high] = [canvas.clientWidth, canvas.clientHeight];
    const scale = 2.3 * Math.min(wide / high / span("x"), 0.8 / span("y"));
    whole = { x: span("x") * scale, y: span("y") * scale, z: 0.01 };
    size = { ...whole };
    centre = { x: 0, y: -0.12, z: 0 };
  }

  function layout() {
    const axis = { visible: false, showspikes: false };
    return {
      margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "rgba(0,0,0,0)", showlegend: false,
      scene: {
        xaxis: { ...axis, range: range.x }, yaxis: { ...axis, range: range.y }, zaxis: { ...axis, range: [-1, 1] },
        aspectmode: "manual", aspectratio: { ...size }, dragmode: "pan",
        camera: {
          projection: { type: "orthographic" }, up: { x: 0, y: 1, z: 0 }, center: { ...centre },
          eye: { ...centre, z: 2 },
        },
      },
    };
  }

  async function draw() {
    const now = state();
    describe(now);
    await Plotly.react(canvas, traces(now), layout(), { displayModeBar: false, responsive: true, scrollZoom: true, logging: 0 });
    if (probed !== undefined) probe(probed);
  }

  const moved = () => Plotly.relayout(canvas, { "scene.aspectratio": { ...size }, "scene.camera": layout().scene.camera });

  function zoom(factor) {
    for (const axis of ["x", "y"]) {
      size[axis] *= factor;
      centre[axis] *= factor;
    }
    moved();
  }

  function pan(x, y) {
    centre.x += 0.2 * x;
    centre.y += 0.2 * y;
    moved();
  }

  // What is said of a triangle: where it was before the load, and the mean of the field over it.
  let probed;
  function probe(triangle) {
    probed = triangle;
    const nodes = [0, 1, 2].map((k) => triangles[3 * triangle + k]);
    const mean = (axis) => nodes.reduce((sum, node) => sum + points[2 * node + axis], 0) / 3;
    const what = shown.minus ? "difference" : "value";
    byId("viewer-probe").textContent =
      `x = ${digits(mean(0))} mm, y = ${digits(mean(1))} mm (undeformed): ${what} ${digits(shown.values[triangle])} ${shown.unit}`;
  }

  function probeMiddle() {
    const at = (axis) => (range[axis][0] + range[axis][1]) / 2 + (centre[axis] / size[axis]) * span(axis);
    const [x, y] = [at("x"), at("y")];
    let best = 0;
    let least = Infinity;
    for (let t = 0; t < triangles.length / 3; t += 1) {
      const nodes = [0, 1, 2].map((k) => triangles[3 * t + k]);
      const off = Math.hypot(
        nodes.reduce((sum, node) => sum + shown.x[node], 0) / 3 - x,
        nodes.reduce((sum, node) => sum + shown.y[node], 0) / 3 - y);
      if (off < least) [best, least] = [t, off];
    }
    probe(best);
  }

  const keys = {
    ArrowLeft: () => pan(-1, 0), ArrowRight: () => pan(1, 0), ArrowUp: () => pan(0, 1), ArrowDown: () => pan(0, -1),
    "+": () => zoom(1.4), "=": () => zoom(1.4), "-": () => zoom(1 / 1.4), 0: () => { showAll(); moved(); },
  };

  // From rest to the full load in four seconds, again and again, until it is pressed once more.
  function animation() {
    const play = byId("viewer-play");
    const load = byId("viewer-load");
    const still = window.matchMedia("(prefers-reduced-motion: reduce)");
    let playing = false;
    async function run() {
      const began = performance.now();
      while (playing && !document.hidden) {
        const time = ((performance.now() - began) / 4000) % 1.25;
        load.value = Math.round(100 * Math.min(1, time));
        await draw();
        await new Promise((next) => setTimeout(() => requestAnimationFrame(next), 50)); // leave the page some time
      }
      toggle(false);
    }
    function toggle(on) {
      if (playing === on) return;
      playing = on;
      play.textContent = on ? "Stop" : "Play";
      play.setAttribute("aria-pressed", String(on));
      if (on) run();
    }
    const obey = () => {
      play.hidden = still.matches;
      if (still.matches) toggle(false);
    };
    play.addEventListener("click", () => toggle(!playing));
    load.addEventListener("pointerdown", () => toggle(false));
    still.addEventListener("change", obey);
    obey();
  }

  async function start() {
    const library = document.createElement("script");
    library.textContent = await (await unpacked("viewer-library")).text();
    document.head.append(library);
    ({ points, triangles } = await pinnrayFields.load());
    fit();
    showAll();
    await draw();
    for (const name of ["viewer-solver", "viewer-quantity", "viewer-show", "viewer-load"]) {
      byId(name)?.addEventListener("input", draw);
    }
    byId("viewer-in").addEventListener("click", () => zoom(1.4));
    byId("viewer-out").addEventListener("click", () => zoom(1 / 1.4));
    byId("viewer-all").addEventListener("click", keys[0]);
    canvas.addEventListener("keydown", (event) => {
      if (!keys[event.key] || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      keys[event.key]();
      probeMiddle();
    });
    canvas.on("plotly_hover", ({ points: [found] }) => probe(found.pointNumber));
    canvas.on("plotly_relayout", (change) => {
      if (change["scene.aspectratio"]) size = { ...size, ...change["scene.aspectratio"] };
      if (change["scene.camera"]) centre = { ...change["scene.camera"].center };
    });
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
    let width = canvas.clientWidth;
    new ResizeObserver(() => {
      if (canvas.clientWidth === width || canvas.clientWidth === 0) return;
      width = canvas.clientWidth;
      keys[0]();
    }).observe(canvas);
    animation();
    box.dataset.ready = "yes";
  }

  // Without WebGL the page stays as it is without scripts: the still pictures show the fields.
  function supported() {
    const canvas = document.createElement("canvas");
    return "DecompressionStream" in window && Boolean(canvas.getContext("webgl2") ?? canvas.getContext("webgl"));
  }

  function give(up) {
    box.hidden = up;
    byId("viewer-absent").hidden = !up;
    if (byId("stills")) byId("stills").open = up;
  }

  if (!supported()) return;
  give(false);
  const seen = new IntersectionObserver((entries) => {
    if (!entries.some((entry) => entry.isIntersecting)) return;
    seen.disconnect();
    start().catch((error) => {
      console.error(error);
      give(true);
    });
  }, { rootMargin: "400px" });
  seen.observe(box);
})();
