"""One cable between two points: its sag, and the errors of other models."""

import numpy as np
from matplotlib.figure import Figure

import sagline as sl

cable = sl.Cable(linear_density=0.067, axial_stiffness=44e3)  # [kg/m], [N]
tension = np.array([20.0, 50.0, 100.0, 200.0])  # along the chord [N]
exact = sl.Catenary().from_tension(
    cable, span=12.0, rise=-4.0, chord_tension=tension
)
for k, pull in enumerate(tension):
    print(
        f"{pull:4.0f} N: {exact.unstrained_length[k]:.4f} m of cable,",
        f"{1e3 * exact.sag[k]:5.0f} mm of sag",
    )

worst = {}  # relative length error at 20 N
for model in (sl.Parabolic(), sl.Empirical(), sl.Elastic(), sl.Straight()):
    length = model.from_tension(cable, 12.0, -4.0, tension).unstrained_length
    worst[type(model).__name__] = 1e3 * abs(length - exact.unstrained_length)[0]
print("error of the length at 20 N:")
for name, millimeters in worst.items():
    print(f"  {name:9} {millimeters:.1f} mm")

figure = Figure(figsize=(6.0, 3.0), layout="constrained")
ax = figure.subplots()
for pull, points in zip(tension, exact.points(100), strict=True):
    ax.plot(*points.T, label=f"{pull:.0f} N")
ax.set(xlabel="distance [m]", ylabel="height [m]")
ax.legend(title="chord tension")
figure.savefig("one_cable.png", dpi=150)
