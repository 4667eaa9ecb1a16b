// The field viewer: one canvas for solver x quantity x field or difference, and the body along the load.
// Numbers come packed in the page (viewer_fields.js), unpacked when the viewer is first in sight.
"use strict";
(() => {
  const byId = (name) => document.getElementById(name);
  const box = byId("viewer");
  if (!box) return;
  const canvas = byId("viewer-canvas");
  const { manifest, others, values, markers, displacement } = pinnrayFields;
  const { FOOT, ink, digits, sheet, view, placed, paint, outline, lines, seen, word, colourBar, scaleBar } = pinnrayBody;
  let points, triangles;
  const chosen = (name) => byId(name)?.value;

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

  const named = ({ solver, against }) => solver.label + (against ? ` minus ${against === "truth" ? "truth" : manifest.reference}` : "");

  // The scale that a panel's colours have, and whether it is symmetric about zero.
  function scaleOf({ solver, number, against }) {
    const quantity = manifest.quantities[number];
    const high = against ? solver.scales[against][number] : quantity.high;
    return { low: against ? -high : quantity.low, high, signed: Boolean(against) || quantity.signed };
  }

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

  // Everything that any solver shows at any load, and a little room around it.
  let range;
  function fit() {
    const found = { x: [Infinity, -Infinity], y: [Infinity, -Infinity] };
    const meet = (axis, value) => {
      found[axis] = [Math.min(found[axis][0], value), Math.max(found[axis][1], value)];
    };
    for (const solver of manifest.solvers) {
      for (const load of [0, ...solver.fractions]) {
        const moved = displacement(solver, load);
        points.forEach((value, k) => meet(k % 2 ? "y" : "x", value + moved[k]));
      }
      for (const [x, y] of [...solver.observed, ...solver.contact]) {
        meet("x", x);
        meet("y", y);
      }
    }
    const room = 0.02 * (found.x[1] - found.x[0]);
    range = { x: [found.x[0] - room, found.x[1] + room], y: [found.y[0] - room, found.y[1] + room] };
  }

  const span = (axis) => range[axis][1] - range[axis][0];
  const breadth = () => canvas.clientWidth / state().panels.length;
  const height = () => canvas.clientHeight - FOOT;

  // What the middle of each panel shows, mm, and pixels a mm.
  let look;
  function showAll() {
    const middle = (axis) => (range[axis][0] + range[axis][1]) / 2;
    look = { scale: Math.min((breadth() - 12) / span("x"), (height() - 4) / span("y")), x: middle("x"), y: middle("y") };
  }

  // An arrow from where the contact is at rest to where it has come, with a head of a tenth of the finger's height.
  function way({ contact: [start, end] }, load) {
    const tip = [0, 1].map((axis) => start[axis] + load * (end[axis] - start[axis]));
    const length = Math.hypot(tip[0] - start[0], tip[1] - start[1]) || 1;
    const [x, y] = [0, 1].map((axis) => (0.1 * span("y") * (tip[axis] - start[axis])) / length);
    const barb = (turn) => [tip[0] - 0.9 * x + turn * 0.45 * y, tip[1] - 0.9 * y - turn * 0.45 * x];
    return [start, tip, barb(1), tip, barb(-1)];
  }

  let shown;
  function render(context, now, width) {
    const each = width / now.panels.length;
    shown = now.panels.map((panel, number) => {
      const { solver } = panel;
      const at = view(look, [(number + 0.5) * each, height() / 2]);
      const moved = displacement(solver, now.load);
      const field = values(panel, now.load);
      const { low, high, signed } = scaleOf(panel);
      const colours = signed ? manifest.differences : manifest.colours;
      context.save();
      context.beginPath();
      context.rect(number * each, 0, each, height());
      context.clip();
      outline(context, manifest.outlines, placed(points, undefined, at), ink("--rule"));
      const places = placed(points, moved, at);
      paint(context, triangles, places, (t) => (field[t] - low) / (high - low), colours);
      outline(context, manifest.outlines, places, ink("--ink"));
      const marks = { seen: [], crosses: [], way: [] };
      if (byId("viewer-marks").checked) {
        Object.assign(marks, { seen: solver.observed, crosses: markers(solver, now.load), way: way(solver, now.load) });
        seen(context, marks.seen, at);
        const arm = 0.013 * span("y");
        for (const [x, y] of marks.crosses) {
          for (const turn of [1, -1]) lines(context, [[x - arm, y - turn * arm], [x + arm, y + turn * arm]], at, ink("--ink"), 2);
        }
        lines(context, marks.way, at, ink("--ink"), 2);
      }
      context.restore();
      const unit = `${panel.against ? "difference, " : ""}${now.quantity.unit}`;
      const least = `${field.some((value) => value < low) ? "≤ " : ""}${digits(low)}`;
      const most = `${field.some((value) => value > high) ? "≥ " : ""}${digits(high)}`;
      const ends = [least, most, unit];
      colourBar(context, [number * each + 8, height()], Math.min(0.5 * each, 260), colours, ends);
      return { panel, at, places, field, marks, ends };
    });
    return scaleBar(context, [width - 8, height()], look.scale, 0.15 * each);
  }

  function draw() {
    const now = state();
    describe(now);
    const bar = render(sheet(canvas, canvas.clientWidth, canvas.clientHeight), now, canvas.clientWidth);
    window.pinnrayViewer = { shown, look: { ...look }, bar };
    if (probed !== undefined) probe(probed);
  }

  let asked;
  const later = () => {
    asked ??= requestAnimationFrame(() => {
      asked = undefined;
      draw();
    });
  };

  function zoom(factor, [x, y] = [look.x, look.y]) {
    look = { scale: look.scale * factor, x: x + (look.x - x) / factor, y: y + (look.y - y) / factor };
    draw();
  }

  function pan(x, y) {
    look.x += (0.1 * x * breadth()) / look.scale;
    look.y += (0.1 * y * breadth()) / look.scale;
    draw();
  }

  // The picture as it stands, with its title, at twice the size of the screen.
  function save() {
    const [title, room] = [byId("viewer-title").textContent, 34];
    const page = document.createElement("canvas");
    const context = sheet(page, canvas.clientWidth, canvas.clientHeight + room, 2);
    context.fillStyle = ink("--paper");
    context.fillRect(0, 0, canvas.clientWidth, canvas.clientHeight + room);
    word(context, title, 8, 10, "left");
    context.translate(0, room);
    render(context, state(), canvas.clientWidth);
    const link = document.createElement("a");
    link.href = page.toDataURL("image/png");
    link.download = `${manifest.name} ${title}`.replace(/[^\w.-]+/g, "-") + ".png";
    link.click();
  }

  // What is said of a triangle: where it was before the load, and the mean of the field over it.
  let probed;
  function probe(triangle) {
    probed = triangle;
    const nodes = [0, 1, 2].map((k) => triangles[3 * triangle + k]);
    const mean = (axis) => nodes.reduce((sum, node) => sum + points[2 * node + axis], 0) / 3;
    const what = shown[0].panel.against ? "difference" : "value";
    const { unit } = manifest.quantities[shown[0].panel.number];
    byId("viewer-probe").textContent =
      `x = ${digits(mean(0))} mm, y = ${digits(mean(1))} mm (undeformed): ${what} ${digits(shown[0].field[triangle])} ${unit}`;
  }

  // The triangle of the first panel whose middle is nearest to a place on the canvas, and how far it is, pixels.
  function nearest([x, y]) {
    const { places } = shown[0];
    let [best, least] = [0, Infinity];
    for (let t = 0; t < triangles.length / 3; t += 1) {
      const middle = (axis) => [0, 1, 2].reduce((sum, k) => sum + places[2 * triangles[3 * t + k] + axis], 0) / 3;
      const off = Math.hypot(middle(0) - x, middle(1) - y);
      if (off < least) [best, least] = [t, off];
    }
    return { best, least };
  }

  const probeMiddle = () => probe(nearest([breadth() / 2, height() / 2]).best);

  const keys = {
    ArrowLeft: () => pan(-1, 0), ArrowRight: () => pan(1, 0), ArrowUp: () => pan(0, 1), ArrowDown: () => pan(0, -1),
    "+": () => zoom(1.4), "=": () => zoom(1.4), "-": () => zoom(1 / 1.4), 0: () => { showAll(); draw(); },
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
        draw();
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
  function pointing() {
    let [entered, held] = [false, undefined];
    const enter = (yes) => {
      entered = yes;
      canvas.classList.toggle("entered", yes);
    };
    const place = ({ offsetX, offsetY }) => [offsetX, offsetY];
    document.addEventListener("pointerdown", (event) => enter(canvas.contains(event.target)));
    document.addEventListener("keydown", (event) => event.key === "Escape" && enter(false));
    canvas.addEventListener("wheel", (event) => {
      if (!entered && !event.ctrlKey) return;
      event.preventDefault();
      const [x, y] = place(event);
      const off = [(x % breadth()) - breadth() / 2, y - height() / 2];
      zoom(1.0015 ** -event.deltaY, [look.x + off[0] / look.scale, look.y - off[1] / look.scale]);
    }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => {
      held = place(event);
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointerup", () => { held = undefined; });
    canvas.addEventListener("pointermove", (event) => {
      const [x, y] = place(event);
      if (held) {
        look.x -= (x - held[0]) / look.scale;
        look.y += (y - held[1]) / look.scale;
        held = [x, y];
        later();
      } else if (x < breadth()) {
        const { best, least } = nearest([x, y]);
        if (least < 8 + look.scale) probe(best);
      }
    });
  }

  async function start() {
    ({ points, triangles } = await pinnrayFields.load());
    fit();
    showAll();
    draw();
    for (const name of ["viewer-solver", "viewer-quantity", "viewer-show", "viewer-load", "viewer-marks"]) {
      byId(name)?.addEventListener("input", later);
    }
    byId("viewer-beside")?.addEventListener("input", keys[0]);
    byId("viewer-save").addEventListener("click", save);
    pointing();
    byId("viewer-in").addEventListener("click", () => zoom(1.4));
    byId("viewer-out").addEventListener("click", () => zoom(1 / 1.4));
    byId("viewer-all").addEventListener("click", keys[0]);
    canvas.addEventListener("keydown", (event) => {
      if (!keys[event.key] || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      keys[event.key]();
      probeMiddle();
    });
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
    new ResizeObserver(() => canvas.clientWidth && keys[0]()).observe(canvas);
    animation();
    box.dataset.ready = "yes";
  }

  // Without a canvas the page stays as it is without scripts: the still pictures show the fields.
  function give(up) {
    box.hidden = up;
    byId("viewer-absent").hidden = !up;
  }

  if (!("DecompressionStream" in window && canvas.getContext("2d"))) return;
  give(false);
  const sight = new IntersectionObserver((entries) => {
    if (!entries.some((entry) => entry.isIntersecting)) return;
    sight.disconnect();
    start().catch((error) => {
      console.error(error);
      give(true);
    });
  }, { rootMargin: "400px" });
  sight.observe(box);
})();
