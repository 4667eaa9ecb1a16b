// The packed numbers of the field viewer: fields of solvers, and displacements along the load.
"use strict";
const pinnrayFields = (() => {
  const byId = (name) => document.getElementById(name);
  const manifest = JSON.parse(byId("viewer-manifest").textContent);

  const { reader } = pinnrayPacked;
  let numbers;

  let points, triangles;
  const read = new Map();
  const kept = (key, make) => read.get(key) ?? read.set(key, make()).get(key);
  const states = (solver) => kept(solver, () => numbers(solver.states));
  const difference = (solver, quantity) => kept(solver.fields[quantity], () => numbers(solver.fields[quantity]));
  const reference = manifest.solvers.find((solver) => solver.isReference);

  function field(solver, quantity) {
    const base = difference(reference, quantity);
    if (solver.isReference) return base;
    return difference(solver, quantity).map((value, triangle) => value + base[triangle]);
  }

  // Displacements of the nodes at a fraction of the load, u and v by turns: linear between recorded states.
  function displacement(solver, fraction) {
    const at = solver.fractions;
    let after = at.findIndex((known) => known >= fraction);
    after = after < 0 ? at.length - 1 : Math.max(after, 1);
    const share = Math.min(1, (fraction - at[after - 1]) / (at[after] - at[after - 1]));
    const all = states(solver);
    const length = points.length;
    return points.map((_, n) =>
      all[(after - 1) * length + n] * (1 - share) + all[after * length + n] * share);
  }

  const sums = (a, b, sign = 1) => a.map((value, n) => value + sign * b[n]);

  // Green-Lagrange strain of each triangle from the displacements of its nodes: xx, yy, xy by turns.
  function strains(moved) {
    const found = new Float64Array(triangles.length);
    for (let t = 0; t < triangles.length; t += 3) {
      const [a, b, c] = [triangles[t], triangles[t + 1], triangles[t + 2]];
      const side = (values, node, axis) => values[2 * node + axis] - values[2 * a + axis];
      const [bx, by, cx, cy] = [side(points, b, 0), side(points, b, 1), side(points, c, 0), side(points, c, 1)];
      const double = bx * cy - cx * by;
      const along = (axis, first, second) => (first * side(moved, b, axis) + second * side(moved, c, axis)) / double;
      const [ux, uy, vx, vy] = [along(0, cy, -by), along(0, -cx, bx), along(1, cy, -by), along(1, -cx, bx)];
      found[t] = ux + (ux * ux + vx * vx) / 2;
      found[t + 1] = vy + (uy * uy + vy * vy) / 2;
      found[t + 2] = (uy + vx + ux * uy + vx * vy) / 2;
    }
    return found;
  }

  const measures = {
    strain_xx: (xx) => 100 * xx,
    strain_yy: (xx, yy) => 100 * yy,
    strain_xy: (xx, yy, xy) => 100 * xy,
    strain_principal: (xx, yy, xy) => 100 * ((xx + yy) / 2 + Math.hypot((xx - yy) / 2, xy)),
    von_mises: (xx, yy, xy) => Math.sqrt(xx * xx - xx * yy + yy * yy + 3 * xy * xy),
  };

  // A quantity of every triangle at a fraction of the load. Along a path that a solver found, strain is that of
  // the nodes' displacements, and stress grows as it does; else both grow with the load, as in the linear law.
  function at(solver, number, fraction) {
    const full = field(solver, number);
    if (fraction === 1) return full;
    const { name } = manifest.quantities[number];
    if (name === "displacement") {
      const moved = displacement(solver, fraction);
      const size = (node) => Math.hypot(moved[2 * node], moved[2 * node + 1]);
      return full.map((_, t) => (size(triangles[3 * t]) + size(triangles[3 * t + 1]) + size(triangles[3 * t + 2])) / 3);
    }
    if (solver.fractions.length === 2) return full.map((value) => fraction * value);
    const now = strains(displacement(solver, fraction));
    const end = kept(`${solver.label}, strain`, () => strains(displacement(solver, 1)));
    const of = (all, t) => measures[name](all[3 * t], all[3 * t + 1], all[3 * t + 2]);
    if (name === "von_mises") return full.map((value, t) => value * Math.min(10, of(now, t) / (of(end, t) || 1)));
    return full.map((value, t) => of(now, t) + fraction * (value - of(end, t)));
  }

  // What is shown: a field, or how far it is from that of the reference or the truth.
  const others = { reference, truth: manifest.solvers.find((solver) => solver.isTruth) };
  function values({ solver, number, against }, fraction) {
    const own = at(solver, number, fraction);
    return against ? sums(own, at(others[against], number, fraction), -1) : own;
  }

  // Markers of a solver at a fraction of the load, each as far from its straight way as the nearest node is.
  function markers(solver, fraction) {
    const [now, end] = [displacement(solver, fraction), displacement(solver, 1)];
    const { points: start, displacements, nodes } = solver.markers;
    return start.map((place, m) => [0, 1].map((axis) =>
      place[axis] + fraction * displacements[m][axis] + now[2 * nodes[m] + axis] - fraction * end[2 * nodes[m] + axis]));
  }

  async function load() {
    numbers = await reader("viewer-data");
    points = numbers(manifest.points);
    triangles = numbers(manifest.triangles);
    return { points, triangles };
  }

  return { manifest, load, others, values, markers, displacement };
})();
