// The emulator of a study's fields, as studies/fields/emulator.py evaluates it.
"use strict";
const pinnrayModel = (() => {
  const manifest = JSON.parse(document.getElementById("explorer-manifest").textContent);
  const varied = manifest.parameters.filter(({ factor }) => !factor);
  let read, mesh;

  const block = (places) => places && {
    ...Object.fromEntries(["inputs", "rates", "weights", "numbers", "mean"].map((name) => [name, read(places[name])])),
    vectors: places.vectors.map(read), factors: (places.factors ?? []).map(read),
  };

  // Displacements at all nodes: those in the middles of edges are kept less the mean of the edge's ends.
  function atNodes([corners, middles]) {
    const [cells, nodal] = [read(manifest.cells), new Float64Array(corners.length + middles.length)];
    nodal.set(corners);
    nodal.set(middles, corners.length);
    for (let t = 0; t < cells.length; t += 6) {
      for (let k = 0; k < 3; k += 1) {
        const [one, other, middle] = [cells[t + k], cells[t + ((k + 1) % 3)], cells[t + 3 + k]];
        for (const axis of [0, 1]) {
          const mean = 0.5 * (corners[2 * one + axis] + corners[2 * other + axis]);
          nodal[2 * middle + axis] = mean + middles[2 * middle + axis - corners.length];
        }
      }
    }
    return nodal;
  }

  async function load() {
    read = await pinnrayPacked.reader("explorer-data");
    mesh = {
      points: read(manifest.points), triangles: read(manifest.triangles), cells: read(manifest.cells), front: read(manifest.front), base: read(manifest.base),
      away: read(manifest.away), space: manifest.space.map((parts) => atNodes(parts.map(read))), errors: read(manifest.errors),
      known: read(manifest.known), lost: read(manifest.lost),
      field: block(manifest.field), numbers: block(manifest.numbers), motion: block(manifest.motion),
    };
    mesh.count = mesh.points.length / 2;
    return mesh;
  }

  // Inputs of the processes: each with a standard deviation of about one; the contact's place is that half way.
  const inputs = (values) => varied.map(({ name, low, high, log }) => {
    const scale = log ? Math.log : (value) => value;
    const way = name === "contact_position" ? 0.5 * manifest.stroke * Math.sin((values.direction * Math.PI) / 180) : 0;
    return Math.sqrt(12) * ((scale(values[name] + way) - scale(low)) / (scale(high) - scale(low)) - 0.5);
  });

  // What forces and energies are predicted over: the exponential of a quadratic polynomial of the inputs.
  function strengthOf(at) {
    const powers = [1, ...at, ...at.flatMap((one, k) => at.slice(k).map((other) => one * other))];
    return Math.exp(powers.reduce((sum, power, k) => sum + power * manifest.strength[k], 0));
  }

  // Matérn's kernel of order 5/2, of a squared distance over the lengths.
  const matern = (square) => {
    const away = Math.sqrt(5 * square);
    return (1 + away + (away * away) / 3) * Math.exp(-away);
  };

  function coefficients({ inputs: known, rates, weights, numbers, vectors }, at) {
    const [count, size] = [vectors.length, at.length];
    const found = new Float64Array(count);
    const samples = weights.length / count;
    const squares = new Float64Array(size);
    for (let n = 0; n < samples; n += 1) {
      for (let d = 0; d < size; d += 1) squares[d] = (known[n * size + d] - at[d]) ** 2;
      for (let mode = 0; mode < count; mode += 1) {
        let sum = 0;
        for (let d = 0; d < size; d += 1) sum += squares[d] * rates[mode * size + d];
        found[mode] += matern(sum) * weights[n * count + mode];
      }
    }
    return found.map((value, mode) => value + numbers[mode]);
  }

  function combined({ mean, vectors }, factors) {
    const found = Float64Array.from(mean);
    vectors.forEach((vector, mode) => {
      const factor = factors[mode];
      for (let k = 0; k < found.length; k += 1) found[k] += factor * vector[k];
    });
    return found;
  }

  function deviations({ inputs: known, rates, numbers, vectors, factors }, at) {
    const size = at.length;
    return factors.map((factor, mode) => {
      const count = Math.floor(Math.sqrt(2 * factor.length)); // rows of a lower triangle
      const covariance = new Float64Array(count);
      for (let n = 0; n < count; n += 1) {
        let sum = 0;
        for (let d = 0; d < size; d += 1) sum += (known[n * size + d] - at[d]) ** 2 * rates[mode * size + d];
        covariance[n] = matern(sum);
      }
      let explained = 0;
      for (let i = 0; i < count; i += 1) {
        let sum = 0;
        for (let j = 0; j <= i; j += 1) sum += factor[(i * (i + 1)) / 2 + j] * covariance[j];
        explained += sum * sum;
      }
      const [spread, noise] = [1, 2].map((row) => numbers[row * vectors.length + mode]);
      return spread * Math.sqrt(Math.max(1 - explained, 0) + noise);
    });
  }

  // Weights of the strokes in the cubic spline at a share of the full one.
  function weights(share) {
    const { shares, spline } = manifest;
    const piece = Math.min(Math.max(shares.findLastIndex((each) => each <= share), 0), spline.length - 1);
    const over = share - shares[piece];
    return spline[piece].map((powers) => powers.reduce((sum, power) => sum * over + power, 0));
  }

  function between(rows, share) {
    const { shares } = manifest;
    const after = Math.min(Math.max(shares.findIndex((each) => each >= share), 1), shares.length - 1);
    const part = Math.min(Math.max((share - shares[after - 1]) / (shares[after] - shares[after - 1]), 0), 1);
    return rows[0].map((_, k) => rows[after - 1][k] * (1 - part) + rows[after][k] * part);
  }

  // Von Mises stress at the nodes, of the displacement gradient's mean over their triangles.
  function stresses(points, moved, young) {
    const { cells, count } = mesh;
    const sums = new Float64Array(4 * count);
    const areas = new Float64Array(count);
    const slopes = new Float64Array(6);
    const byλ = new Float64Array(6);
    for (let t = 0; t < cells.length; t += 6) {
      const node = (k) => cells[t + (k % 3)];
      for (let l = 0; l < 3; l += 1) {
        slopes[2 * l] = points[2 * node(l + 1) + 1] - points[2 * node(l + 2) + 1];
        slopes[2 * l + 1] = points[2 * node(l + 2)] - points[2 * node(l + 1)];
      }
      const double = slopes[0] * slopes[3] - slopes[1] * slopes[2];
      const u = (k, axis) => moved[2 * cells[t + k] + axis];
      for (let corner = 0; corner < 3; corner += 1) {
        for (let axis = 0; axis < 2; axis += 1) {
          for (let l = 0; l < 3; l += 1) {
            byλ[2 * l + axis] = l === corner ? 3 * u(l, axis) : 4 * u(3 + edge(l, corner), axis) - u(l, axis);
          }
        }
        const n = cells[t + corner];
        for (let axis = 0; axis < 2; axis += 1) {
          for (let along = 0; along < 2; along += 1) {
            let sum = 0;
            for (let l = 0; l < 3; l += 1) sum += byλ[2 * l + axis] * slopes[2 * l + along];
            sums[4 * n + 2 * axis + along] += sum;
          }
        }
        areas[n] += double;
      }
    }
    const [λ, μ] = manifest.lame.map((each) => each * young);
    const found = new Float64Array(count);
    for (let n = 0; n < count; n += 1) {
      const [a, b, c, d] = [0, 1, 2, 3].map((k) => sums[4 * n + k] / areas[n]);
      found[n] = laws[manifest.law](a, b, c, d, λ, μ);
    }
    return found;
  }

  // The middle between two corners: edges are 0-1, 1-2, 2-0.
  const edge = (one, other) => (one + other === 1 ? 0 : one + other === 3 ? 1 : 2);

  const misesOf = (xx, yy, xy, zz) => Math.sqrt(
    ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2 + 3 * xy * xy);

  // Cauchy stress of the gradient du/dx = a, du/dy = b, dv/dx = c, dv/dy = d, as solvers/elasticity.py has it.
  const laws = {
    "neo-hookean": (a, b, c, d, λ, μ) => volumetric(a, b, c, d, λ, () => μ),
    gent: (a, b, c, d, λ, μ) => volumetric(a, b, c, d, λ, (trace, log) => μ / (1 - 2 * (trace - log))),
    "st-venant-kirchhoff": (a, b, c, d, λ, μ) => {
      const [xx, yy, xy] = [a + (a * a + c * c) / 2, d + (b * b + d * d) / 2, (b + c + a * b + c * d) / 2];
      const volume = λ * (xx + yy);
      const [sxx, syy, sxy] = [volume + 2 * μ * xx, volume + 2 * μ * yy, 2 * μ * xy];
      const [p, q, r, s] = [1 + a, b, c, 1 + d];
      const j = p * s - q * r;
      const push = (u, v, w, z) => (u * (sxx * w + sxy * z) + v * (sxy * w + syy * z)) / j;
      return misesOf(push(p, q, p, q), push(r, s, r, s), push(p, q, r, s), volume / j);
    },
  };

  function volumetric(a, b, c, d, λ, modulus) {
    const j = (1 + a) * (1 + d) - b * c;
    const log = Math.log(j);
    const trace = a + d + (a * a + b * b + c * c + d * d) / 2;
    const μ = modulus(trace, log);
    const zz = (λ * log) / j;
    return misesOf(
      (μ / j) * (2 * a + a * a + b * b) + zz, (μ / j) * (2 * d + c * c + d * d) + zz,
      (μ / j) * (b + c + a * c + b * d), zz);
  }

  const turn = ([p, q, r]) => {
    const [x0, y0, x1, y1] = [q[0] - p[0], q[1] - p[1], r[0] - q[0], r[1] - q[1]];
    return (Math.atan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1) * 180) / Math.PI;
  };

  // The front at an abscissa: place and displacement.
  function onFront(points, moved, x) {
    const { front } = mesh;
    let after = front.findIndex((node) => points[2 * node] >= x);
    after = after < 0 ? front.length - 1 : Math.max(after, 1);
    const [one, other] = [front[after - 1], front[after]];
    const part = (x - points[2 * one]) / (points[2 * other] - points[2 * one]);
    const mix = (array, axis) => array[2 * one + axis] * (1 - part) + array[2 * other + axis] * part;
    return [mix(points, 0), mix(points, 1), mix(moved, 0), mix(moved, 1)];
  }

  function wrap(points, moved, position) {
    const { front } = mesh;
    const [base, tip] = [front[0], front[front.length - 1]];
    const [x, y, u, v] = onFront(points, moved, position);
    const at = (node) => [points[2 * node], points[2 * node + 1]];
    const after = (node) => [0, 1].map((axis) => points[2 * node + axis] + moved[2 * node + axis]);
    return turn([after(base), [x + u, y + v], after(tip)]) - turn([at(base), [x, y], at(tip)]);
  }

  // Whether a node is away from corners and from the contact about an abscissa.
  function counts(points, node, position) {
    const beside = Math.max(Math.abs(points[2 * node] - position) - manifest.contactWidth / 2, 0);
    return mesh.away[node] && Math.hypot(beside, points[2 * node + 1]) > manifest.thickness;
  }

  function nearest(rows, at) {
    let [best, place] = [Infinity, -1];
    for (let n = 0; n < rows.length / at.length; n += 1) {
      const away = at.reduce((sum, value, d) => sum + (rows[n * at.length + d] - value) ** 2, 0);
      if (away < best) [best, place] = [away, n];
    }
    return { best, place };
  }

  // Why a finger cannot be predicted; empty if it can.
  function fault(values) {
    const at = inputs(values);
    const lost = nearest(mesh.lost, at);
    return lost.best < nearest(mesh.known, at).best
      ? `The nearest sample of the study has no field: ${manifest.reasons[lost.place]}` : "";
  }

  // Everything of a finger that does not depend on the stroke.
  function finger(values) {
    const at = inputs(values);
    const numbers = combined(mesh.numbers, coefficients(mesh.numbers, at));
    return {
      values, points: mesh.motion ? combined(mesh.motion, coefficients(mesh.motion, at)) : mesh.points,
      strength: strengthOf(at), path: combined(mesh.field, coefficients(mesh.field, at)), deviations: deviations(mesh.field, at),
      numbers: numbers.map((value, k) => value * manifest.units[k % 5]),
    };
  }

  const mixed = (rows, each, chosen) => chosen.reduce(
    (sum, weight, k) => sum.map((value, n) => value + weight * rows[k * each + n]), new Array(each).fill(0));

  // Half width of an interval over its scale and calibration.
  function indicator({ deviations: spread }, chosen) {
    const strokes = chosen.length;
    const modes = mesh.space.length;
    return Math.sqrt(spread.reduce((total, deviation, p) => {
      let length = 0;
      for (let r = 0; r < modes; r += 1) {
        let sum = 0;
        for (let k = 0; k < strokes; k += 1) sum += chosen[k] * mesh.errors[(p * modes + r) * strokes + k];
        length += sum * sum;
      }
      return total + length * deviation * deviation;
    }, 0));
  }

  // Force along the stroke, N, with half of its interval, at a share of the full stroke.
  function force(known, share) {
    const { values, numbers, strength } = known;
    const chosen = weights(share);
    const [u, v] = mixed(numbers, 5, chosen).map((value) => value * share);
    const angle = (values.direction * Math.PI) / 180;
    const factor = strength * (values.young / manifest.baseYoung) * values.depth;
    const half = indicator(known, chosen) * between(manifest.scales, share)[1] * between(manifest.calibration, share)[1];
    return { value: factor * (u * Math.sin(angle) - v * Math.cos(angle)), half: factor * half };
  }

  function predicted(known, share) {
    const { values, points, path, numbers } = known;
    const chosen = weights(share);
    const modes = mesh.space.length;
    const factors = mixed(path, modes, chosen);
    const moved = new Float64Array(mesh.space[0].length);
    mesh.space.forEach((vector, mode) => {
      const factor = share * factors[mode];
      for (let k = 0; k < moved.length; k += 1) moved[k] += factor * vector[k];
    });
    const width = Math.max(mixed(numbers, 5, chosen)[4], 0);
    const stress = stresses(points, moved, values.young);
    const position = values.contact_position;
    let largest = 0;
    for (let n = 0; n < mesh.count; n += 1) if (stress[n] > largest && counts(points, n, position)) largest = stress[n];
    const tip = mesh.front[mesh.front.length - 1];
    const ratio = values.young / manifest.baseYoung;
    const level = indicator(known, chosen);
    const [scales, calibration] = [manifest.scales, manifest.calibration].map((rows) => between(rows, share));
    const found = [force(known, share).value, moved[2 * tip], moved[2 * tip + 1], wrap(points, moved, position), largest, width];
    const units = [known.strength * ratio * values.depth, 1, 1, 1, ratio, 1];
    const figures = manifest.figures.map(({ name }, k) => ({
      name, value: found[k], half: level * scales[k + 1] * calibration[k + 1] * units[k],
    }));
    const size = Math.sqrt(moved.reduce((sum, value) => sum + value * value, 0) / moved.length);
    return { points, moved, stress, figures, error: (level * scales[0] * calibration[0]) / size };
  }

  // Displacement of points of the finger at rest, or undefined outside it.
  function at({ points, moved }, [x, y]) {
    const { cells } = mesh;
    for (let t = 0; t < cells.length; t += 6) {
      const [ax, ay, bx, by, cx, cy] = [0, 1, 2].flatMap((k) => [points[2 * cells[t + k]], points[2 * cells[t + k] + 1]]);
      const double = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay);
      const l1 = ((x - ax) * (cy - ay) - (cx - ax) * (y - ay)) / double;
      const l2 = ((bx - ax) * (y - ay) - (x - ax) * (by - ay)) / double;
      const l0 = 1 - l1 - l2;
      if (Math.min(l0, l1, l2) < -1e-6) continue;
      const shape = [l0 * (2 * l0 - 1), l1 * (2 * l1 - 1), l2 * (2 * l2 - 1), 4 * l0 * l1, 4 * l1 * l2, 4 * l2 * l0];
      return [0, 1].map((axis) => shape.reduce((sum, value, k) => sum + value * moved[2 * cells[t + k] + axis], 0));
    }
    return undefined;
  }

  return { manifest, load, finger, force, predicted, fault, at };
})();
