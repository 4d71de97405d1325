/* Poses and points of a page. SI units. */
"use strict";

const robot = (() => {
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

  return { dot, placed, plus, posed };
})();
