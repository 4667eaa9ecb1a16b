// Draws a body of triangles on a canvas, with outline, colour bar and bar of length: for viewer and explorer.
"use strict";
const pinnrayBody = (() => {
  const FONT = "12px system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif";
  const FOOT = 44; // pixels below the body, for the bars
  const MEASURED = "#d1006c";
  const ink = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const digits = (value, count = 3) => String(Number(value.toPrecision(count))).replace("-", "−");

  // The context of a canvas whose pixels are those of the screen, in units of the page.
  function sheet(canvas, width, height, ratio = window.devicePixelRatio || 1) {
    const [across, up] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== across || canvas.height !== up) Object.assign(canvas, { width: across, height: up });
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    return context;
  }

  // Where points of the plane, mm, are in a box of the canvas: `middle` of the box shows a point, at a scale.
  const view = ({ scale, x, y }, middle) => ({
    scale, X: (value) => middle[0] + (value - x) * scale, Y: (value) => middle[1] - (value - y) * scale,
  });

  // Places of nodes on the canvas, from points and their displacements, x and y by turns.
  function placed(points, moved, { X, Y }) {
    const places = new Float64Array(points.length);
    for (let k = 0; k < points.length; k += 2) {
      places[k] = X(points[k] + (moved ? moved[k] : 0));
      places[k + 1] = Y(points[k + 1] + (moved ? moved[k + 1] : 0));
    }
    return places;
  }

  // Each triangle in the colour at its share of the scale; the triangles of a colour are one path.
  function paint(context, triangles, places, share, colours) {
    const paths = colours.map(() => new Path2D());
    for (let t = 0; t < triangles.length; t += 3) {
      const step = Math.floor(share(t / 3) * colours.length) || 0;
      const path = paths[Math.min(colours.length - 1, Math.max(0, step))];
      const [a, b, c] = [2 * triangles[t], 2 * triangles[t + 1], 2 * triangles[t + 2]];
      path.moveTo(places[a], places[a + 1]);
      path.lineTo(places[b], places[b + 1]);
      path.lineTo(places[c], places[c + 1]);
      path.closePath();
    }
    context.lineWidth = 0.6;
    paths.forEach((path, k) => {
      context.fillStyle = context.strokeStyle = colours[k];
      context.fill(path);
      context.stroke(path);
    });
  }

  function outline(context, outlines, places, colour) {
    context.strokeStyle = colour;
    context.lineWidth = 1;
    context.beginPath();
    for (const path of outlines) {
      path.forEach((node, k) => context[k ? "lineTo" : "moveTo"](places[2 * node], places[2 * node + 1]));
    }
    context.stroke();
  }

  function lines(context, places, { X, Y }, colour, width = 1.2) {
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.beginPath();
    places.forEach(([x, y], k) => context[k ? "lineTo" : "moveTo"](X(x), Y(y)));
    context.stroke();
  }

  // Circles around places where markers were seen.
  function seen(context, places, { X, Y }) {
    context.strokeStyle = MEASURED;
    context.lineWidth = 1.6;
    for (const [x, y] of places) {
      context.beginPath();
      context.arc(X(x), Y(y), 4, 0, 2 * Math.PI);
      context.stroke();
    }
  }

  function word(context, text, x, y, align) {
    Object.assign(context, { fillStyle: ink("--ink"), font: FONT, textBaseline: "top", textAlign: align });
    context.fillText(text, x, y);
  }

  function colourBar(context, [left, top], length, colours, [low, high, title]) {
    colours.forEach((colour, k) => {
      context.fillStyle = colour;
      context.fillRect(left + (k * length) / colours.length, top + 6, length / colours.length + 1, 9);
    });
    word(context, low, left, top + 18, "left");
    word(context, high, left + length, top + 18, "right");
    word(context, title, left + 0.5 * length, top + 18, "center");
  }

  // A bar of a round length, mm, that ends at a place, and takes at most some pixels: its length and pixels.
  function scaleBar(context, [right, top], scale, most) {
    const power = 10 ** Math.floor(Math.log10(most / scale));
    const length = [5, 2, 1].find((step) => step * power * scale <= most) * power;
    context.fillStyle = ink("--ink");
    context.fillRect(right - length * scale, top + 10, length * scale, 3);
    word(context, `${Number(length.toPrecision(1))} mm`, right, top + 18, "right");
    return { length, pixels: length * scale };
  }

  return { FOOT, ink, digits, sheet, view, placed, paint, outline, lines, seen, word, colourBar, scaleBar };
})();
