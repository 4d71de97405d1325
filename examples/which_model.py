"""Errors of cable models: position errors with lengths from each model."""

import numpy as np
from matplotlib.figure import Figure

import sagline as sl

path = sl.article_path()
models = (
    sl.Straight(),
    sl.Elastic(),
    sl.Empirical(),
    sl.Parabolic(),
    sl.Catenary(),
)
figure = Figure(figsize=(6.0, 3.5), layout="constrained")
ax = figure.subplots()
largest = {}
for robot in map(sl.load_robot, ("article-suspended", "article-mixed")):
    for model in models:
        # exact cables of the model's lengths
        proof = sl.confirm(sl.inverse(robot, path, model=model))
        error = 1e3 * np.linalg.norm(proof.position_error, axis=1)
        largest[robot.name, type(model).__name__] = error.max()
    row = {
        model: largest[robot.name, model]
        for name, model in largest
        if name == robot.name
    }
    print(robot.name)
    for name, millimeters in row.items():
        print(f"  {name:9} {millimeters:.3g} mm")
    ax.semilogy(row.keys(), row.values(), "o-", label=robot.name)
ax.set(ylabel="largest position error [mm]", ylim=(1e-12, None))
ax.grid(axis="y")
ax.legend()
figure.savefig("which_model.png", dpi=150)
