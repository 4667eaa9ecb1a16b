// The packed numbers of the field viewer: fields of solvers, and displacements along the load.
"use strict";
const pinnrayFields = (() => {
  const byId = (name) => document.getElementById(name);
  const manifest = JSON.parse(byId("viewer-manifest").textContent);

  async function unpacked(name) {
    const bytes = Uint8Array.from(atob(byId(name).textContent.trim()), (letter) => letter.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip")));
  }

  const kinds = { float32: Float32Array, uint32: Uint32Array, uint16: Uint16Array };
  let buffer;
  function numbers(place) {
    const raw = new kinds[place.kind](buffer, place.offset, place.length);
    return place.step === undefined ? raw : Float64Array.from(raw, (step) => place.low + place.step * step);
  }

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

  async function load() {
    buffer = await (await unpacked("viewer-data")).arrayBuffer();
    points = numbers(manifest.points);
    triangles = numbers(manifest.triangles);
    return { points, triangles };
  }

  return { manifest, unpacked, load, kept, field, difference, displacement };
})();
