/* Where one looks from: around a point, by mouse, touch and keys. */
"use strict";

const camera = (() => {
  const FIELD = 0.7; // rad, upright
  const START = [-1.12, 0.36]; // rad, about the vertical and above the horizon
  const BORDER = 1.08; // of what is to be seen, to stay off the edges
  const { dot, plus } = robot;
  const scaled = (factor, a) => a.map((each) => factor * each);

  /** A camera; changed() is called after every move. */
  function made(changed) {
    let [azimuth, elevation] = START, target = [0, 0, 0], distance = 10, aspect = 1.5, box = null, moved = false;

    /** To the right, up, and toward the camera. */
    function axes() {
      const [ca, sa, ce, se] = [Math.cos(azimuth), Math.sin(azimuth), Math.cos(elevation), Math.sin(elevation)];
      return [[-sa, ca, 0], [-ca * se, -sa * se, ce], [ca * ce, sa * ce, se]];
    }

    /** The nearest place that sees all of a box. */
    function fit() {
      const [right, up, toward] = axes(), slope = Math.tan(FIELD / 2) / BORDER, [low, high] = box;
      const corners = Array.from({ length: 8 }, (_, k) => [0, 1, 2].map((i) => ((k >> i) & 1 ? high : low)[i]));
      target = scaled(0.5, plus(low, 1, high));
      for (let pass = 0; pass < 6; pass++) {
        const seen = corners.map((corner) => [right, up, toward].map((axis) => dot(axis, plus(corner, -1, target))));
        const needed = ([x, y, depth]) => depth + Math.max(Math.abs(x) / (slope * aspect), Math.abs(y) / slope);
        distance = Math.max(...seen.map(needed));
        const middle = (k) => {
          const places = seen.map((one) => one[k] / (distance - one[2]));
          return (distance * (Math.max(...places) + Math.min(...places))) / 2;
        };
        target = plus(plus(target, middle(0), right), middle(1), up);
      }
    }

    /** All of a box, from the usual side. */
    function show(low, high) {
      [azimuth, elevation, box, moved] = [...START, [low, high], false];
      fit();
    }

    function resize(width, height) {
      aspect = width / height;
      if (box && !moved) fit();
    }

    function turn(by, over) {
      azimuth -= by;
      elevation = Math.min(Math.max(elevation + over, -0.2), 1.55);
      if (box && !moved) fit(); // all of it stays in view while one looks around
      changed();
    }

    function zoom(factor) {
      moved = true;
      distance *= factor;
      changed();
    }

    /** Shift what is looked at by a part of the picture's height. */
    function pan(x, y) {
      const [right, up] = axes(), far = 2 * distance * Math.tan(FIELD / 2);
      moved = true;
      target = plus(plus(target, -x * far, right), y * far, up);
      changed();
    }

    /** From the world to the picture, column by column, for WebGL. */
    function matrix() {
      const [right, up, toward] = axes(), eye = plus(target, distance, toward), size = Math.tan(FIELD / 2);
      const near = 0.01 * distance, far = 30 * distance;
      const rows = [
        [...scaled(1 / (size * aspect), right), -dot(right, eye) / (size * aspect)],
        [...scaled(1 / size, up), -dot(up, eye) / size],
        [...scaled((far + near) / (far - near), scaled(-1, toward)), 0],
        [...scaled(-1, toward), dot(toward, eye)],
      ];
      rows[2][3] = (dot(toward, eye) * (far + near) - 2 * far * near) / (far - near);
      return Float32Array.from({ length: 16 }, (_, k) => rows[k % 4][k >> 2]);
    }

    /** Where a point is seen, as shares of width and height from the top left, and how far away it is. */
    function seen(point) {
      const [right, up, toward] = axes(), away = plus(point, -1, target), size = Math.tan(FIELD / 2);
      const depth = distance - dot(toward, away);
      return { x: 0.5 + dot(right, away) / (2 * depth * size * aspect), y: 0.5 - dot(up, away) / (2 * depth * size), depth };
    }

    /** By how much a point moves in the plane of the picture, for shares of its width and height. */
    function shift(point, x, y) {
      const [right, up] = axes(), tall = 2 * seen(point).depth * Math.tan(FIELD / 2);
      return plus(scaled(x * tall * aspect, right), -y * tall, up);
    }

    return { matrix, pan, resize, seen, shift, show, turn, zoom };
  }

  return { made };
})();
