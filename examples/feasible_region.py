"""Feasible region: 4,000 poses, and the shortfall of the infeasible ones."""

import numpy as np
from matplotlib.figure import Figure

import sagline as sl

robot = sl.load_robot("cogiro")
x, z = np.meshgrid(np.linspace(-7.0, 7.0, 80), np.linspace(0.2, 5.2, 50))
position = np.stack([x, np.zeros_like(x), z], axis=-1).reshape(-1, 3)
plan = sl.inverse(robot, sl.Pose.from_euler(position, 0.0, 0.0, 0.0))
share = plan.feasible.mean()
print(f"{share:.1%} of the plane y = 0 is wrench-feasible")
lost = sl.PoseStatus(plan.status[0])
print(
    f"corner: {lost.name}, shortfall {plan.shortfall[0]:.0f} N,",
    f"cables {np.flatnonzero(plan.blocking[0])}",
)

figure = Figure(figsize=(6.0, 3.0), layout="constrained")
ax = figure.subplots()
shown = np.where(np.isfinite(plan.shortfall), plan.shortfall, np.nan).reshape(
    x.shape
)
image = ax.pcolormesh(x, z, shown, cmap="viridis_r")
ax.contour(x, z, plan.feasible.reshape(x.shape), levels=[0.5], colors="black")
ax.set(xlabel="x [m]", ylabel="z [m]", aspect="equal")
figure.colorbar(image, label="shortfall [N]")
figure.savefig("feasible_region.png", dpi=150)
