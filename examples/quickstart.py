"""From a robot and a path to cable lengths, and the proof that they are right."""

import numpy as np

import sagline as sl

robot = sl.load_robot("article-suspended")
path = sl.quintic_path([(0, 0, 1.5), (4, 3, 1.5), (-4, 3, 3)], speed=1.5)
plan = sl.inverse(robot, path)  # tensions within the limits, and the lengths to wind
proof = sl.confirm(plan)  # where the platform really rests on exact cables of these lengths
error = np.linalg.norm(proof.position_error, axis=1).max()
print(f"{len(path)} poses, lengths {plan.unstrained_length.min():.2f} to {plan.unstrained_length.max():.2f} m")
print(f"largest position error {1e3 * error:.1e} mm")
plan.save("run.nc")
