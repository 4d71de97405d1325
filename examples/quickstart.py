"""Quickstart: cable lengths of a robot along a path, and their proof."""

import numpy as np

import sagline as sl

robot = sl.load_robot("article-suspended")
path = sl.quintic_path([(0, 0, 1.5), (4, 3, 1.5), (-4, 3, 3)], speed=1.5)
plan = sl.inverse(robot, path)  # tensions within limits, lengths to wind
proof = sl.confirm(plan)  # true position of the platform on exact cables
error = np.linalg.norm(proof.position_error, axis=1).max()
shortest, longest = plan.unstrained_length.min(), plan.unstrained_length.max()
print(f"{len(path)} poses, lengths {shortest:.2f} to {longest:.2f} m")
print(f"largest position error {1e3 * error:.1e} mm")
plan.save("run.nc")
sl.plot.save(sl.plot.overview(plan), "quickstart.png")
