/* How redundant cables share a load: the tensions of least norm within limits; docs/model.md, section 5. Matrices are
   arrays of rows. */
"use strict";

const sharing = (() => {
  const RANK = 1e-9; // of a row's length, that must be left after the rows before it are taken out
  const NOTHING = 1e-9; // of what would have to be left over, from which on limits contradict each other

  const dot = (a, b) => a.reduce((sum, each, i) => sum + each * b[i], 0);
  const plus = (a, factor, b) => a.map((each, i) => each + factor * b[i]);
  const combined = (rows, factors, width) => rows.reduce((sum, row, k) => plus(sum, factors[k], row), Array(width).fill(0));

  /** A vector without its parts along orthonormal rows, twice, because once leaves rounding errors; and those parts. */
  function without(vector, rows) {
    const parts = rows.map(() => 0);
    for (let pass = 0; pass < 2; pass++)
      rows.forEach((row, k) => {
        const part = dot(row, vector);
        parts[k] += part;
        vector = plus(vector, -part, row);
      });
    return { rest: vector, parts };
  }

  /** Orthonormal rows Q and a lower triangle, matrix = triangle Q; null where rank is lost. */
  function factored(matrix) {
    const q = [], triangle = [];
    for (const row of matrix) {
      const { rest, parts } = without(row, q), length = Math.hypot(...rest);
      if (!(length > RANK * Math.hypot(...row))) return null;
      q.push(rest.map((each) => each / length));
      triangle.push([...parts, length]);
    }
    return { q, triangle };
  }

  /** The shortest x with matrix x = right, from its factors. */
  function shortest({ q, triangle }, right, width) {
    const parts = [];
    triangle.forEach((row, k) => parts.push((right[k] - dot(parts, row)) / row[k]));
    return combined(q, parts, width);
  }

  /** Orthonormal vectors that a matrix takes to zero. */
  function nullSpace({ q }, width) {
    const found = [];
    const units = Array.from({ length: width }, (_, i) => Array.from({ length: width }, (_, k) => Number(i === k)));
    while (q.length + found.length < width) {
      const rests = units.map((unit) => without(unit, [...q, ...found]).rest);
      const longest = rests.reduce((best, each) => (Math.hypot(...each) > Math.hypot(...best) ? each : best));
      found.push(without(longest.map((each) => each / Math.hypot(...longest)), [...q, ...found]).rest);
    }
    return found;
  }

  /** Weights >= 0 of columns whose sum is nearest to a goal: Lawson & Hanson 1974, chapter 23. */
  function nonNegative(columns, goal) {
    const weights = columns.map(() => 0), free = new Set();
    const left = () => columns.reduce((rest, column, i) => (weights[i] ? plus(rest, -weights[i], column) : rest), goal);
    for (let round = 0; round < 10 * columns.length; round++) {
      const rest = left(), gains = columns.map((column, i) => (free.has(i) ? 0 : dot(column, rest) / Math.hypot(...column)));
      const best = gains.indexOf(Math.max(...gains));
      if (!(gains[best] > 1e-13)) break;
      free.add(best);
      while (free.size) {
        const chosen = [...free], wanted = leastSquares(chosen.map((i) => columns[i]), goal);
        if (!wanted) { // the column says nothing that the others do not
          free.delete(best);
          return weights;
        }
        const wrong = chosen.filter((_, k) => wanted[k] <= 0);
        const shares = wrong.map((i) => weights[i] / (weights[i] - wanted[chosen.indexOf(i)]));
        const share = Math.min(1, ...shares);
        chosen.forEach((i, k) => (weights[i] += share * (wanted[k] - weights[i])));
        if (!wrong.length) break;
        wrong.forEach((i, k) => {
          if (shares[k] <= share) { weights[i] = 0; free.delete(i); }
        });
      }
    }
    return weights;
  }

  /** Factors of columns whose sum is nearest to a goal; null where the columns are not independent. */
  function leastSquares(columns, goal) {
    const factors = factored(columns);
    if (!factors) return null;
    const parts = factors.q.map((row) => dot(row, goal)), found = columns.map(() => 0);
    for (let k = columns.length - 1; k >= 0; k--) {
      let rest = parts[k];
      for (let i = k + 1; i < columns.length; i++) rest -= factors.triangle[i][k] * found[i];
      found[k] = rest / factors.triangle[k][k];
    }
    return found;
  }

  /** The point nearest to zero with row . x >= bound for each of rows; or which bounds contradict each other. */
  function nearestPoint(rows, bounds) {
    if (bounds.every((bound) => bound <= 0)) return { point: rows[0].map(() => 0), active: [] };
    const scale = Math.max(...bounds.map(Math.abs)), width = rows[0].length;
    const columns = rows.map((row, i) => [...row, bounds[i] / scale]);
    const weights = nonNegative(columns, [...Array(width).fill(0), 1]);
    const active = weights.flatMap((weight, i) => (weight > 0 ? [i] : []));
    const rest = 1 - weights.reduce((sum, weight, i) => sum + (weight * bounds[i]) / scale, 0);
    if (!(rest > NOTHING)) return { point: null, active };
    const steps = weights.map((weight) => (weight * scale) / rest);
    return { point: combined(rows, steps, width), active };
  }

  return { combined, dot, factored, nearestPoint, nullSpace, plus, shortest };
})();
