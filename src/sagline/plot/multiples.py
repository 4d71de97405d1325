"""Small multiples: one panel a cable, all on one scale."""

from __future__ import annotations

from math import ceil
from typing import TYPE_CHECKING

import numpy as np

from sagline.core.arguments import choice, instance
from sagline.kinematics.plan import Plan
from sagline.plot.courses import INFEASIBLE, LENGTHS, TENSIONS, clock_of, dress_over
from sagline.plot.sheet import BLUE, VERMILLION, draw_course, shade, sheet
from sagline.plot.style import current

if TYPE_CHECKING:
    from matplotlib.figure import Figure

OTHERS = "0.82"  # color of the other cables behind each
EACH = 1.45  # in, that a row of panels is tall
LIMITED = {"chord_tension": "chord", "frame_end_tension": "frame_end"}


def small_multiples(plan: Plan, quantity: str = "chord_tension") -> Figure:
    """What each cable does over time, in a panel of its own on one scale, before all others in gray.

    Where lines are many and cross, this is easier to read than one panel of all, on paper without color too. Limits of
    the robot are dotted where they are of this quantity and in sight.

    Args:
        plan: The plan; over the number of the pose where it follows no path.
        quantity: What `sl.plot.tensions` or `sl.plot.lengths` draw: "chord_tension", "horizontal_tension",
            "vertical_force", "frame_end_tension" and "platform_end_tension" [N], "unstrained_length" [m] and
            "adjusting_length" [mm].

    Returns:
        A figure of a panel for each cable.

    Raises:
        InvalidValueError: If there is no such quantity.
    """
    labels = {name: (label, 1.0) for name, label in TENSIONS.items()} | LENGTHS
    label, scale = labels[choice(quantity, "quantity", labels)]
    values = scale * np.atleast_2d(getattr(instance(plan, Plan, "plan").state.cables, quantity))
    clock, robot, count = clock_of(plan), plan.state.one_robot, values.shape[1]
    columns = min(count, 2 if current().narrow else 4)
    rows = ceil(count / columns)
    figure = sheet(0.4 + rows * EACH)
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).flat
    for i, ax in enumerate(panels):
        if i >= count:
            ax.set_axis_off()
            continue
        for other in np.delete(values, i, axis=1).T:
            draw_course(ax, clock, other, color=OTHERS, linewidth=0.6, zorder=1.5)
        draw_course(ax, clock, values[:, i], color=BLUE, linewidth=1.3, zorder=2.0, label=f"cable {i}")
        shade(ax, clock, [(gap.first, gap.last) for gap in plan.gaps], INFEASIBLE)
        dress_over(ax, plan, "")
        ax.set_xlabel("")
        ax.set_title(f"cable {i}", fontsize=current().tick, loc="left", pad=2.0)
        ax.label_outer()
    low, high = panels[0].get_ylim()
    for i, ax in enumerate(panels[:count]):
        for limit in (robot.tension_min[i], robot.tension_max[i]):
            if LIMITED.get(quantity) == robot.tension_limits_of and low <= limit <= high:
                ax.axhline(limit, color=VERMILLION, linewidth=0.8, linestyle=":", zorder=1.8)
    figure.supxlabel("pose" if plan.path is None else "time [s]", fontsize=current().label)
    figure.supylabel(label, fontsize=current().label)
    return figure
