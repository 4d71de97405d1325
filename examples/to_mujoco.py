"""MuJoCo model of a published robot, with cables as straight springs."""

from pathlib import Path

import sagline as sl

robot = sl.load_robot("ipanema-2")
pose = sl.Pose.from_euler((0.5, -0.3, 1.0), 0.1, 0.0, 0.0)
text = sl.dump_mjcf(robot, pose)
Path("ipanema-2.xml").write_text(text, encoding="utf-8")
print(f"{robot.cable_count} tendons in ipanema-2.xml; show it with:")
sl.plot.save(sl.plot.robot(robot, pose), "to_mujoco.png")
print("python -m mujoco.viewer --mjcf=ipanema-2.xml")
