/* What there is to see of a robot at a moment. */
"use strict";

const scene = (() => {
  const CABLE = 2.4, THIN = 1.1; // px
  const GRAY = [0.51, 0.53, 0.56]; // of a cable without a tension

  /** The color of a tension, 0 to 1 each: that of the legend. */
  function colored(colors, tension) {
    if (!Number.isFinite(tension)) return GRAY;
    const { low, high, steps } = colors;
    const inside = Math.min(Math.max(tension, low), high), place = (Math.log(inside / low) / Math.log(high / low)) * (steps.length - 1);
    const first = Math.min(Math.floor(place), steps.length - 2), rest = place - first;
    return steps[first].map((each, k) => ((1 - rest) * each + rest * steps[first + 1][k]) / 255);
  }

  /** A color of the style sheet, 0 to 1 each. */
  function named(name) {
    const text = getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
    return [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16) / 255);
  }

  const identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
  const standing = ({ position, matrix }) =>
    [0, 1, 2, 3].flatMap((column) => [0, 1, 2, 3].map((row) =>
      row === 3 ? Number(column === 3) : column === 3 ? position[row] : matrix[row][column]));

  /** The scene on a canvas; facts: what `sagline.share.machine` says. */
  async function made(canvas, facts, view) {
    const drawn = renderer.on(canvas);
    if (!drawn) return null;
    const { machine, picture, colors } = facts, [low, high] = [picture.low, picture.high];
    const size = Math.hypot(...high.map((each, k) => each - low[k])), floor = low[2] - 0.004 * size;
    const meshes = {};
    for (const name of ["frame", "winches", "platform"].filter((each) => picture[each])) {
      const { corners: [x, y, z] } = await states.unpacked(...picture[name]);
      meshes[name] = drawn.mesh(Array.from(x).flatMap((each, k) => [each, y[k], z[k]]));
    }

    const segments = (points, color, width, dashed = false) => {
      const numbers = [];
      for (let k = 1; k < points.length; k++)
        if (!dashed || k % 2) numbers.push(...points[k - 1], ...points[k], ...color, ...(color.length < 4 ? [1] : []), width);
      return numbers;
    };

    /** Lines on the floor, a round distance apart. */
    function grid(color) {
      const ten = 10 ** Math.floor(Math.log10(size / 8)), step = [5, 2, 1].find((each) => each * ten <= size / 8) * ten;
      const found = [], [from, to] = [low, high].map((corner, k) => [0, 1].map((i) => (k ? Math.ceil : Math.floor)(corner[i] / step - (k ? -1 : 1)) * step));
      for (const [i, j] of [[0, 1], [1, 0]])
        for (let place = from[i]; place <= to[i] + step / 2; place += step) {
          const end = (other) => (i === 0 ? [place, other, floor] : [other, place, floor]);
          found.push(...segments([end(from[j]), end(to[j])], [...color, 0.55], THIN));
        }
      return found;
    }

    /** The rim of each pulley, as it stands for its cable. */
    function pulleys(courses, color) {
      return courses.flatMap((points, i) => {
        const radius = machine.radii[i], frame = points[0], [x, y] = robot.plus(points[points.length - 1], -1, frame), span = Math.hypot(x, y);
        if (!(radius > 0)) return [];
        const away = span > 0 ? [x / span, y / span] : [1, 0];
        const round = Array.from({ length: 33 }, (_, k) => (k * Math.PI) / 16);
        return segments(round.map((angle) => {
          const out = radius * (1 - Math.cos(angle));
          return [frame[0] + away[0] * out, frame[1] + away[1] * out, frame[2] + radius * Math.sin(angle)];
        }), color, 2);
      });
    }

    /** moment: pose, feasible; courses, there, taut, tension (told), each. trace: points of the way, or null. */
    function draw(moment, trace) {
      const { pose, courses, there, taut, tension, feasible } = moment;
      const [steel, ground, ink] = ["steel", "ground", "shadow"].map(named);
      const body = named(feasible === false ? "infeasible" : "platform"), place = standing(pose);
      drawn.begin(view.matrix());
      drawn.segments(grid(ground), true);
      const shadow = place.map((each, k) => (k % 4 === 2 ? (k === 14 ? floor : 0) : each));
      drawn.draw(meshes.platform, shadow, [...ink, 0.22], true);
      drawn.draw(meshes.frame, identity, [...steel, 1]);
      if (meshes.winches) drawn.draw(meshes.winches, identity, [...steel.map((each) => 0.85 * each), 1]);
      drawn.draw(meshes.platform, place, [...body, 1]);
      const cables = courses.map((points, i) => (there[i] ? points : []));
      const shadows = cables.flatMap((points) => segments(points.map(([x, y]) => [x, y, floor]), [...ink, 0.1], THIN));
      drawn.segments(shadows, true);
      const found = trace ? segments(trace, named("way"), 1.6) : [];
      cables.forEach((points, i) => found.push(...segments(points, colored(colors, tension[i]), CABLE, !taut[i])));
      drawn.segments([...found, ...pulleys(courses, steel)]);
    }

    return { draw };
  }

  return { colored, made };
})();
