/* A robot at a pose: calls of its kernels, for what is drawn and written. SI units. */
"use strict";

const robot = (() => {
  const SHORTEST = 1e-9; // m, of a chord
  const dot = (a, b) => a.reduce((sum, each, i) => sum + each * b[i], 0);
  const plus = (a, factor, b) => a.map((each, i) => each + factor * b[i]);

  /** A pose from its position and its unit quaternion x, y, z, w, with its rotation matrix as rows. */
  function posed(position, [x, y, z, w]) {
    const matrix = [
      [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
      [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
      [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ];
    return { position, quaternion: [x, y, z, w], matrix };
  }

  const placed = (pose, point) => pose.position.map((each, k) => each + dot(pose.matrix[k], point));

  /** Functions of a robot; of: its kernels, as `kernels.made` returns them. */
  function made(machine, of) {
    const each = (array) => Array.from(array), where = (flags) => flags.flatMap((flag, i) => (flag ? [i] : []));
    const place = (pose) => of.pose.set([...pose.position, ...pose.quaternion]);

    /** A platform at rest: tensions of least norm within their limits and lengths, or why there are none. */
    function balanced(pose) {
      place(pose);
      of.inverse();
      if (machine.undecided.includes(of.status[0])) of.decide();
      const status = of.status[0], [proved, enough] = of.bracket, found = { pose, status, feasible: status === 0 };
      if (status === 0) return { ...found, tension: each(of.tension), length: each(of.length) };
      const chordless = where(each(of.span).map((span, i) => !(Math.hypot(span, of.rise[i]) >= SHORTEST)));
      if (status !== machine.infeasible) return { ...found, blocking: status === machine.chordless ? chordless : [], short: NaN };
      return { ...found, blocking: where(each(of.blocking)), short: enough === Infinity && Number.isFinite(proved) ? NaN : enough };
    }

    /** The equilibrium of a platform on cables of given lengths, from a pose close by. */
    function atRest(lengths, pose) {
      place(pose);
      of.given.set(lengths);
      of.forward();
      const [x, y, z, ...turn] = of.rest;
      return { pose: posed([x, y, z], turn), status: of.restStatus[0], tension: each(of.restTension) };
    }

    /** Points of each cable at chord tensions, from frame anchor over pulley to platform end; straight where NaN. */
    function courses(pose, tensions) {
      place(pose);
      of.drawn.set(tensions);
      of.draw();
      const { drawn, points } = of, count = points.length / (3 * drawn.length);
      return each(drawn).map((_, i) => Array.from({ length: count }, (_, k) => {
        const first = 3 * (i * count + k);
        return [points[first], points[first + 1], points[first + 2]];
      }));
    }

    return { atRest, balanced, courses };
  }

  return { dot, made, placed, plus, posed };
})();
