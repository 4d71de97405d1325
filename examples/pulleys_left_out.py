"""Position errors of plans without pulleys and dead length."""

import numpy as np
from matplotlib.figure import Figure

import sagline as sl

robots = ("cogiro", "article-prototype", "ipanema-1", "expo2015-lucia")
left_out = {
    "pulleys of 25 mm": sl.Winch(0.025),  # [m]
    "pulleys of 50 mm": sl.Winch(0.050),
    "3 m of dead length": sl.Winch(dead_cable=3.0),
}


def errors(robot: sl.Robot, winch: sl.Winch) -> np.ndarray:
    """Position errors [mm] at 405 level poses of the test box."""
    box = robot.test_box
    assert box is not None
    steps = map(np.linspace, box.low, box.high, (9, 9, 5))
    grid = np.stack(np.meshgrid(*steps), axis=-1).reshape(-1, 3)
    poses = sl.Pose.from_euler(grid, 0.0, 0.0, 0.0)
    home = sl.Pose.from_euler(0.5 * (box.low + box.high), 0.0, 0.0, 0.0)
    real = robot.replace(winches=winch)
    planned = sl.inverse(robot, poses).unstrained_length
    # the zeros are set at home, where the position is correct
    wound = planned - sl.inverse(robot, home).unstrained_length
    lengths = sl.inverse(real, home).unstrained_length + wound
    found = sl.forward(real, lengths, start=poses)
    assert found.solved.all()
    off: np.ndarray = np.linalg.norm(found.pose.position - grid, axis=1)
    return 1e3 * off


found = {
    name: [errors(sl.load_robot(name), winch) for winch in left_out.values()]
    for name in robots
}
print(f"{'mean, largest [mm]':20}" + "".join(f"{w:>19}" for w in left_out))
for name, rows in found.items():
    cells = [f"{row.mean():.1f}, {row.max():.0f}" for row in rows]
    print(f"{name:20}" + "".join(f"{cell:>19}" for cell in cells))

figure = Figure(figsize=(7.0, 3.4), layout="constrained")
ax = figure.subplots()
colors = ("tab:cyan", "tab:blue", "tab:orange")
for k, (label, color) in enumerate(zip(left_out, colors, strict=True)):
    mean = np.array([rows[k].mean() for rows in found.values()])
    most = np.array([rows[k].max() for rows in found.values()])
    place = np.arange(len(robots)) + 0.26 * (k - 1)
    ax.bar(place, mean, width=0.22, color=color, label=f"{label}, mean")
    ax.vlines(place, mean, most, color=color)
    ax.plot(place, most, "_", color=color, markersize=9)
ax.plot([], [], "k_", markersize=9, label="largest")
ax.set_xticks(range(len(robots)), robots)
ax.set(ylabel="position error [mm]", ylim=(0.0, 190.0))
ax.grid(axis="y", alpha=0.4)
ax.legend(loc="upper right")
figure.savefig("pulleys_left_out.png", dpi=150)
