/* A robot at a pose: where its cables run, how they hang at a tension, and which tensions carry the platform;
   docs/model.md, sections 4, 5 and 10. The tests compare it with the library's. SI units. */
"use strict";

const robot = (() => {
  const { combined, dot, factored, nearestPoint, nullSpace, plus, shortest } = sharing;
  const ROUNDS = 30, LAST_ROUNDS = 12, EXITS = 12, LIMIT_STEPS = 60;
  const FREE = 1e-4; // what a newton of redundant tension counts beside one of force that is short
  const SETTLED = 1e-10; // N, or 1e-15 of the largest tension: pulls that change by less stand still
  const TAUT = 1e-3; // of half a cable's weight: with less tension it does not hang usefully

  /** Columns of the rotation of a unit quaternion x, y, z, w, as rows of a matrix. */
  function rotation([x, y, z, w]) {
    return [
      [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
      [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
      [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ];
  }

  const placed = (pose, point) => pose.position.map((each, k) => each + dot(pose.matrix[k], point));

  /** Each cable's plane and chord: from the frame anchor, or as the tangent to its pulley. */
  function cablesAt(machine, pose) {
    return machine.cables.map((cable) => {
      const end = placed(pose, cable.platform), run = plus(end, -1, cable.frame);
      const across = Math.hypot(run[0], run[1]), up = run[2], { radius, entry } = cable;
      const away = across > 0 ? [run[0] / across, run[1] / across] : [1, 0];
      const x = across - radius, z = entry * up, far = x * x + z * z;
      const chord = radius > 0 ? Math.sqrt(far - radius * radius) : Math.hypot(across, up);
      const cosine = radius > 0 ? (radius * z + chord * x) / far : across / chord;
      const sine = radius > 0 ? (entry * (chord * z - radius * x)) / far : up / chord;
      const there = chord >= 1e-9 && (radius === 0 || cosine > 0);
      return { cable, end, across, up, away, chord, cosine, sine, there, weight: cable.density * machine.gravity };
    });
  }

  /** A cable at a chord tension: the free span from where it leaves its pulley, and its pull T_z - tau sin phi. */
  function hang(line, tension, gravity) {
    const { cable, sine, cosine } = line, { radius, entry } = cable;
    let wrap = radius > 0 ? Math.atan2(cosine, entry * (sine - (line.weight * line.chord) / (2 * tension))) : 0;
    let found;
    for (let k = 0; k < EXITS; k++) {
      const span = line.across - radius * (1 - Math.cos(wrap)), rise = line.up - radius * entry * Math.sin(wrap);
      const chord = Math.hypot(span, rise);
      const along = radius > 0 ? (tension * cosine * chord) / span : tension;
      found = catenary.exact({ span, rise, tension: along, gravity, density: cable.density, stiffness: cable.stiffness });
      if (!(radius > 0)) break;
      const next = Math.atan2(found.horizontal, entry * (found.vertical - found.weight * found.length));
      const change = Math.abs(next - wrap);
      wrap = next;
      if (change < 1e-14) break;
    }
    return { ...found, wrap, line, pull: found.vertical - tension * sine };
  }

  /** Unstrained length off the drum: what hangs, what lies on the pulley, what is behind. */
  function lengthOf(hung) {
    const { radius, entry, dead, rise, stiffness } = hung.line.cable, { wrap, weight } = hung;
    const leaving = 1 + hung.frameEnd / stiffness, beta = (weight * radius) / stiffness;
    const entering = Math.sqrt(leaving ** 2 - 2 * beta * entry * Math.sin(wrap));
    const last = Math.sqrt(entering ** 2 - (2 * weight * rise) / stiffness);
    const falls = entry * beta * (1 - Math.cos(wrap) - wrap * Math.sin(wrap));
    return hung.length + radius * (wrap / leaving - falls / leaving ** 3) + (2 * dead) / (entering + last);
  }

  /** The chord tension at which the tension at the frame end has a value, on the taut side, by secants. */
  function tautAt(line, value, gravity, otherwise) {
    const half = (line.weight * line.chord) / 2;
    if (half === 0 || value === Infinity) return value;
    let tau = half * line.sine + Math.sqrt(Math.max(value ** 2 - (half * line.cosine) ** 2, 0));
    tau = Math.max(tau, TAUT * half);
    let before = 0, last = 0, slope = 1 + (2 * half) / line.cable.stiffness, miss = Infinity;
    for (let k = 0; k < LIMIT_STEPS && slope > 0; k++) {
      const there = hang(line, tau, gravity).frameEnd;
      if (k > 0 && Math.abs(tau - before) > 1e-12 * tau) slope = (there - last) / (tau - before);
      if (!(slope > 0)) break;
      [before, last, miss] = [tau, there, there - value];
      tau = Math.max(tau - miss / slope, 0.5 * tau);
      if (Math.abs(tau - before) <= 1e-14 * tau) break;
    }
    return Math.abs(miss) <= 1e-9 * value ? before : otherwise;
  }

  function limitsOf(machine, lines) {
    if (machine.limits_of !== "frame_end") return machine.cables.map(({ low, high }) => [low, high ?? Infinity]);
    return lines.map((line) => {
      const loosest = Math.max((line.weight * line.chord * line.sine) / 2, 0);
      const [low, high] = [line.cable.low, line.cable.high ?? Infinity];
      return [tautAt(line, low, machine.gravity, loosest), tautAt(line, high, machine.gravity, 0)];
    });
  }

  /** What one newton of each chord tension does, and what one newton of each pull takes away, as wrenches. */
  function wrenches(machine, pose, lines) {
    const center = placed(pose, machine.center_of_mass);
    return lines.map(({ end, away, cosine, sine }) => {
      const [rx, ry, rz] = plus(end, -1, center), [ux, uy, uz] = [-away[0] * cosine, -away[1] * cosine, -sine];
      const gives = [ux, uy, uz, ry * uz - rz * uy, rz * ux - rx * uz, rx * uy - ry * ux];
      return { gives, takes: [0, 0, 1, ry, -rx, 0] };
    });
  }

  /** Tensions start + directions . x within limits, x shortest; and the cables whose limits decide. */
  function within(limits, start, directions) {
    const rows = [], bounds = [], cables = [];
    limits.forEach(([low, high], i) => {
      const row = directions.map((each) => each[i]);
      rows.push(row);
      bounds.push(low - start[i]);
      cables.push(i);
      if (high === Infinity) return;
      rows.push(row.map((each) => -each));
      bounds.push(start[i] - high);
      cables.push(i);
    });
    const { point, active } = nearestPoint(rows, bounds);
    const blocking = [...new Set(active.map((i) => cables[i]))].sort((a, b) => a - b);
    return { point, blocking, tension: point && plus(start, 1, combined(directions, point, limits.length)) };
  }

  /** The least change of the force that would do, and the cables whose limits stand against the load; null: none would. */
  function shortfall(setting) {
    const { factors, basis, limits, lines, gravity, forces } = setting, m = lines.length;
    const units = Array.from({ length: forces }, (_, k) => factors.q.map((_, i) => Number(i === k)));
    const directions = [...units.map((unit) => shortest(factors, unit, m)), ...basis.map((row) => row.map((each) => each / FREE))];
    let pulls = setting.pulls, last = null;
    for (let round = 0; round < LAST_ROUNDS; round++) {
      const { point, blocking, tension } = within(limits, shortest(factors, setting.right(pulls), m), directions);
      if (!point) return { short: Infinity, blocking };
      const short = Math.hypot(...point.slice(0, forces));
      if (last && Math.abs(short - last.short) <= 1e-6 * short) return { short, blocking };
      last = { short, blocking };
      pulls = lines.map((line, i) => hang(line, tension[i], gravity).pull);
    }
    return last;
  }

  /** A platform at rest: tensions of least norm within their limits, cables as they hang, or why there are none. */
  function balanced(machine, pose) {
    const lines = cablesAt(machine, pose), missing = lines.findIndex((line) => !line.there), { gravity, freedom } = machine;
    if (missing >= 0) return { lines, feasible: false, blocking: [missing], why: "chord" };
    const acts = wrenches(machine, pose, lines), along = (wrench) => freedom.map((row) => dot(row, wrench));
    const columns = acts.map(({ gives }) => along(gives));
    const factors = factored(freedom.map((_, k) => columns.map((column) => column[k])));
    if (!factors) return { lines, feasible: false, blocking: [], why: "singular" };
    const basis = nullSpace(factors, lines.length), limits = limitsOf(machine, lines);
    const load = [0, 0, machine.mass * gravity, 0, 0, 0];
    const right = (pulls) => along(acts.reduce((sum, { takes }, i) => plus(sum, pulls[i], takes), load));
    let pulls = lines.map(({ weight, chord }) => (weight * chord) / 2);
    for (let round = 0; round < ROUNDS; round++) {
      const { tension } = within(limits, shortest(factors, right(pulls), lines.length), basis);
      if (!tension) {
        const forces = freedom.filter((row) => Math.hypot(...row.slice(0, 3)) > 0).length;
        const setting = { factors, basis, limits, lines, gravity, forces, pulls, right };
        return { lines, feasible: false, why: "limits", ...shortfall(setting) };
      }
      const hung = lines.map((line, i) => hang(line, tension[i], gravity));
      const change = Math.max(...hung.map(({ pull }, i) => Math.abs(pull - pulls[i])));
      pulls = hung.map(({ pull }) => pull);
      if (change <= SETTLED + 1e-15 * Math.max(...tension)) return { lines, feasible: true, blocking: [], tension, hung };
    }
    return { lines, feasible: false, blocking: [], why: "rounds" };
  }

  /** Points of a cable from its frame anchor over its pulley to its platform end; straight where nothing hangs. */
  function course(line, hung, points, wraps) {
    const { frame, radius, entry } = line.cable;
    const inPlane = (x, z) => [frame[0] + line.away[0] * x, frame[1] + line.away[1] * x, frame[2] + z];
    const wrap = hung ? hung.wrap : radius > 0 && line.there ? Math.atan2(line.cosine, entry * line.sine) : 0;
    const onto = (angle) => [radius * (1 - Math.cos(angle)), radius * entry * Math.sin(angle)];
    const [x, z] = onto(wrap), found = [];
    if (radius > 0) for (let k = 0; k < wraps; k++) found.push(inPlane(...onto((wrap * k) / wraps)));
    for (let k = 0; k <= points; k++) {
      const place = hung ? catenary.at(hung, k / points) : { x: ((line.across - x) * k) / points, z: ((line.up - z) * k) / points };
      found.push(inPlane(x + place.x, z + place.z));
    }
    return found;
  }

  return { balanced, cablesAt, course, hang, lengthOf, placed, rotation };
})();
