// The field viewer: one canvas for solver x quantity x field or difference, and the body along the load.
// Numbers come packed in the page (viewer_fields.js), and so does Plotly.js, unpacked when the viewer is first in sight.
"use strict";
(() => {
  const byId = (name) => document.getElementById(name);
  const box = byId("viewer");
  if (!box) return;
  const canvas = byId("viewer-canvas");
  const { manifest, unpacked, others } = pinnrayFields;
  const { traces, shape, way, scaleOf, ink } = pinnrayTraces;
  let points, triangles;
  const chosen = (name) => byId(name)?.value;
  const FOOT = 80; // pixels below the body, for the colour bars

  // One panel or two: of what solver, which quantity, and minus what.
  function state() {
    const number = Number(chosen("viewer-quantity"));
    const panel = (solver, show) => ({ solver, number, against: solver === others[show] ? undefined : others[show] && show });
    const solver = manifest.solvers[chosen("viewer-solver")];
    const [show, beside] = [chosen("viewer-show"), chosen("viewer-beside")];
    const panels = [panel(solver, show)];
    if (beside in others) panels.push(panel(solver, beside));
    else if (beside) panels.push(panel(manifest.solvers[beside], show));
    return { panels, number, quantity: manifest.quantities[number], load: Number(chosen("viewer-load")) / 100 };
  }

  const digits = (value) => String(Number(value.toPrecision(3))).replace("-", "−");
  const named = ({ solver, against }) => solver.label + (against ? ` minus ${against === "truth" ? "truth" : manifest.reference}` : "");

  // What the numbers mean, beside the canvas; the page's words for those who do not see it.
  function describe({ panels, quantity, load }) {
    const title = `${quantity.title}, ${quantity.unit}: `;
    byId("viewer-title").textContent = title + (panels.length > 1
      ? `left ${named(panels[0])}; right ${named(panels[1])}` : named(panels[0]));
    const scale = (panel) => {
      const { low, high } = scaleOf(panel);
      return panel.against
        ? `±${digits(high)} ${quantity.unit}, a scale of its own`
        : `${digits(low)} to ${digits(high)} ${quantity.unit}, one scale for all solvers`;
    };
    const same = panels.filter(({ against, solver }) => !against && solver === others[chosen("viewer-show")]);
    byId("viewer-note").textContent =
      `Colours: ${[...new Set(panels.map(scale))].join("; ")}; values beyond take the end colours. ` +
      `Shape and colours at ${Math.round(100 * load)} % of the load, displacement at true scale: ` +
      `${[...new Set(panels.map(({ solver }) => solver.path))].join("; ")}.` +
      same.map(({ solver }) => ` ${solver.label} is what the others are compared with.`).join("");
  }

  // View: `range` are the data's limits; the scene scales them to `size`, which zooms, around the camera's centre.
  let range, size, centre;

  // Everything that any solver shows at any load, and a little room around it.
  function fit() {
    const found = { x: [Infinity, -Infinity], y: [Infinity, -Infinity] };
    const meet = (axis, value) => {
      found[axis] = [Math.min(found[axis][0], value), Math.max(found[axis][1], value)];
    };
    for (const solver of manifest.solvers) {
      for (const load of [0, ...solver.fractions]) {
        const { x, y } = shape(solver, load);
        for (const value of x) meet("x", value);
        for (const value of y) meet("y", value);
      }
      for (const [x, y] of [...solver.observed, ...way(solver, 1, 0)]) {
        meet("x", x);
        meet("y", y);
      }
    }
    const room = 0.02 * (found.x[1] - found.x[0]);
    range = { x: [found.x[0] - room, found.x[1] + room], y: [found.y[0] - room, found.y[1] + room] };
  }

  const span = (axis) => range[axis][1] - range[axis][0];
  const height = () => canvas.clientHeight - FOOT;
  const breadth = () => canvas.clientWidth / state().panels.length - 8;
  const perMillimetre = () => (height() / 2) * (size.x / span("x")); // the camera shows a height of 2

  // The whole body in its panel.
  function showAll() {
    const scale = 1.94 * Math.min(breadth() / height() / span("x"), 1 / span("y"));
    size = { x: span("x") * scale, y: span("y") * scale, z: 0.01 };
    centre = { x: 0, y: 0, z: 0 };
  }

  const camera = () => ({
    projection: { type: "orthographic" }, up: { x: 0, y: 1, z: 0 }, center: { ...centre }, eye: { ...centre, z: 2 },
  });

  // A bar of a round length at the lower right, and its words.
  function scaleBar() {
    const wanted = (0.15 * breadth()) / perMillimetre();
    const power = 10 ** Math.floor(Math.log10(wanted));
    const length = [5, 2, 1].find((step) => step * power <= wanted) * power;
    const share = (length * perMillimetre()) / canvas.clientWidth;
    const line = { type: "line", xref: "paper", yref: "paper", x0: 0.99 - share, x1: 0.99, y0: 0.02, y1: 0.02 };
    return {
      shapes: [{ ...line, line: { color: ink("--ink"), width: 3 } }],
      annotations: [{
        xref: "paper", yref: "paper", x: 0.99, y: 0.03, xanchor: "right", yanchor: "bottom", showarrow: false,
        text: `${Number(length.toPrecision(1))} mm`, font: { color: ink("--ink"), size: 12 },
      }],
    };
  }

  function layout(count) {
    const axis = { visible: false, showspikes: false };
    const scene = (left, right) => ({
      xaxis: { ...axis, range: range.x }, yaxis: { ...axis, range: range.y }, zaxis: { ...axis, range: [-1, 1] },
      aspectmode: "manual", aspectratio: { ...size }, dragmode: "pan", camera: camera(), domain: { x: [left, right] },
    });
    return {
      margin: { l: 0, r: 0, t: 0, b: FOOT }, paper_bgcolor: "rgba(0,0,0,0)", showlegend: false, ...scaleBar(),
      scene: scene(0, count > 1 ? 0.495 : 1), ...(count > 1 ? { scene2: scene(0.505, 1) } : {}),
    };
  }

  let shown;
  async function draw() {
    const now = state();
    const count = now.panels.length;
    describe(now);
    const found = now.panels.map((panel, number) => traces(panel, now.load, {
      scene: number ? "scene2" : "scene",
      bar: { x: (number + 0.5) / count, len: 0.7 / count },
      head: 0.1 * span("y"),
      marks: byId("viewer-marks").checked,
    }));
    shown = { ...found[0], panel: now.panels[0], unit: now.quantity.unit };
    await Plotly.react(canvas, found.flatMap(({ drawn }) => drawn), layout(count),
      { displayModeBar: false, responsive: true, scrollZoom: true, logging: 0 });
    if (probed !== undefined) probe(probed);
  }

  function moved() {
    const change = { ...scaleBar() };
    for (const scene of state().panels.length > 1 ? ["scene", "scene2"] : ["scene"]) {
      change[`${scene}.aspectratio`] = { ...size };
      change[`${scene}.camera`] = camera();
    }
    return Plotly.relayout(canvas, change);
  }

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

  // The picture as it stands, with its title, at twice the size of the screen.
  async function save() {
    const [title, room] = [byId("viewer-title").textContent, 34];
    const page = { ...canvas.layout, paper_bgcolor: ink("--paper"), margin: { l: 0, r: 0, t: room, b: FOOT } };
    page.title = { text: title, x: 0.01, xanchor: "left", font: { size: 14, color: ink("--ink") } };
    const image = await Plotly.toImage({ data: canvas.data, layout: page },
      { format: "png", width: canvas.clientWidth, height: canvas.clientHeight + room, scale: 2 });
    const link = document.createElement("a");
    link.href = image;
    link.download = `${manifest.name} ${title}`.replace(/[^\w.-]+/g, "-") + ".png";
    link.click();
  }

  // What is said of a triangle: where it was before the load, and the mean of the field over it.
  let probed;
  function probe(triangle) {
    probed = triangle;
    const nodes = [0, 1, 2].map((k) => triangles[3 * triangle + k]);
    const mean = (axis) => nodes.reduce((sum, node) => sum + points[2 * node + axis], 0) / 3;
    const what = shown.panel.against ? "difference" : "value";
    byId("viewer-probe").textContent =
      `x = ${digits(mean(0))} mm, y = ${digits(mean(1))} mm (undeformed): ${what} ${digits(shown.shown[triangle])} ${shown.unit}`;
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

  // A wheel or a finger that passes over the picture scrolls the page; with Ctrl, or after a click, it zooms.
  function entering() {
    let entered = false;
    const enter = (yes) => {
      entered = yes;
      canvas.classList.toggle("entered", yes);
    };
    document.addEventListener("pointerdown", (event) => enter(canvas.contains(event.target)));
    document.addEventListener("keydown", (event) => event.key === "Escape" && enter(false));
    const pass = (event) => {
      if (!entered && !event.ctrlKey) event.stopPropagation();
    };
    for (const kind of ["wheel", "touchstart", "touchmove"]) box.addEventListener(kind, pass, { capture: true, passive: true });
  }

  async function start() {
    const library = document.createElement("script");
    library.textContent = await (await unpacked("viewer-library")).text();
    document.head.append(library);
    ({ points, triangles } = await pinnrayFields.load());
    fit();
    showAll();
    await draw();
    for (const name of ["viewer-solver", "viewer-quantity", "viewer-show", "viewer-load", "viewer-marks"]) {
      byId(name)?.addEventListener("input", draw);
    }
    byId("viewer-beside")?.addEventListener("input", () => {
      showAll();
      draw();
    });
    byId("viewer-save").addEventListener("click", save);
    entering();
    byId("viewer-in").addEventListener("click", () => zoom(1.4));
    byId("viewer-out").addEventListener("click", () => zoom(1 / 1.4));
    byId("viewer-all").addEventListener("click", keys[0]);
    canvas.addEventListener("keydown", (event) => {
      if (!keys[event.key] || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      keys[event.key]();
      probeMiddle();
    });
    canvas.on("plotly_hover", ({ points: [found] }) => {
      if (found.data.scene !== "scene2") probe(found.pointNumber);
    });
    canvas.on("plotly_relayout", (change) => {
      if (change.shapes) return; // by this page itself
      for (const scene of ["scene", "scene2"]) {
        const [aspect, seen] = [change[`${scene}.aspectratio`], change[`${scene}.camera`]];
        if (aspect) size = { ...size, ...aspect };
        if (seen) centre = { ...seen.center };
        if (aspect || seen) moved();
      }
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
