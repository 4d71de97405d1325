"""A cascade: 1 kHz loops in the drives, and a slow one on the pose.

The platform that is built is heavier than the planned one.
"""

import numpy as np

import sagline as sl

PERIOD, GAIN = 0.01, 0.5  # s, 1/s
planned = sl.load_robot("article-prototype")
assert planned.winches is not None
gains = {"position_gain": 20.0, "speed_gain": 4000.0, "integral_gain": 80e3}
planned = planned.replace(winches=planned.winches.replace(**gains))
built = planned.replace(mass=1.2 * planned.mass)  # the loop does not know it
goal = sl.Pose.from_euler([0.3, 0.2, 1.2], 0.0, 0.0, 0.0)
plan = sl.inverse(planned, goal, tension=sl.MinimumNorm())
start = sl.forward(built, plan.unstrained_length, start=goal).state  # it sags
rope = sl.Damping(loss_time=5e-3, air_damping=0.5)  # assumed


def settle(gain: float) -> list[float]:
    """Distance from the goal, period by period, in twenty seconds [m]."""
    machine = sl.Simulator(built, start, damping=rope)
    solver = sl.InverseSolver(planned, tension=sl.MinimumNorm())
    lengths, aim = start.unstrained_length.copy(), goal.position.copy()
    away = []
    for _ in range(2000):
        seen = machine.step(lengths, PERIOD)
        error = goal.position - seen.position  # as a tracker would see it
        aim += gain * PERIOD * error
        status = solver.step_into(aim, goal.quaternion, lengths)
        if status != sl.PoseStatus.SOLVED:
            raise SystemExit(status.text)  # stop the winches
        away.append(float(np.linalg.norm(error)))
    return away


without, closed = settle(0.0), settle(GAIN)
print(f"no loop on the pose: {1e3 * max(without[-100:]):.2f} mm off")
print(f"with it: {1e3 * max(closed[-100:]):.2f} mm after 20 s")
