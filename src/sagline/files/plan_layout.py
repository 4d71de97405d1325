"""What stands in a plan's file: each variable, where the plan keeps it, its dimensions and its unit."""

from __future__ import annotations

from sagline.cables.status import CableStatus
from sagline.files.variables import Known, Quantity
from sagline.kinematics.status import PoseStatus

QUANTITIES = (
    Quantity(
        "unstrained_length",
        "unstrained_length",
        ("cable",),
        "m",
        "unstrained length L to wind",
        known=Known.SOLVED,
        low=0.0,
    ),
    Quantity(
        "chord_tension",
        "chord_tension",
        ("cable",),
        "N",
        "tension along the chord, T_x / cos phi",
        known=Known.SOLVED,
        low=0.0,
    ),
    Quantity(
        "horizontal_tension",
        "state.cables.horizontal_tension",
        ("cable",),
        "N",
        "horizontal tension T_x",
        known=Known.SOLVED,
        low=0.0,
    ),
    Quantity(
        "vertical_force",
        "state.cables.vertical_force",
        ("cable",),
        "N",
        "vertical force T_z on the cable at its platform end, up positive",
        known=Known.SOLVED,
    ),
    Quantity(
        "span", "state.cables.span", ("cable",), "m", "horizontal distance from frame end to platform end", low=0.0
    ),
    Quantity("rise", "state.cables.rise", ("cable",), "m", "height of the platform end above the frame end"),
    Quantity("cable_status", "state.cables.status", ("cable",), "", "how each cable's calculation ended", CableStatus),
    Quantity("pose_status", "status", (), "", "how each pose's calculation ended", PoseStatus),
    Quantity(
        "shortfall",
        "shortfall",
        (),
        "N",
        "smallest change of the force that would make the pose feasible",
        known=Known.SOMEWHERE,
        low=0.0,
        infinite=True,
    ),
    Quantity(
        "wrench_residual",
        "wrench_residual",
        ("residual_part",),
        "N, N m",
        "norms of the unbalanced force and moment in the free motions",
        known=Known.SOLVED,
        low=0.0,
    ),
    Quantity(
        "blocking",
        "blocking",
        ("cable",),
        "",
        "whether the cable's limits stand against the needed wrench",
        values=bool,
    ),
    Quantity(
        "wrench",
        "state.wrench",
        ("wrench_part",),
        "N, N m",
        "external and inertial wrench about the center of mass in world axes, without gravity",
    ),
    Quantity("position", "state.pose.position", ("axis",), "m", "position of the platform origin in the world"),
    Quantity(
        "quaternion",
        "state.pose.quaternion",
        ("quaternion_part",),
        "1",
        "rotation from platform to world, scalar last",
    ),
)

# of a plan whose cables have something behind them
MACHINE = (
    Quantity(
        "free_length",
        "free_length",
        ("cable",),
        "m",
        "unstrained length of the hanging cable",
        known=Known.SOLVED,
        low=0.0,
    ),
    Quantity(
        "free_chord_tension",
        "state.cables.chord_tension",
        ("cable",),
        "N",
        "tension along the chord of the hanging cable, from where it leaves its pulley",
        known=Known.SOLVED,
        low=0.0,
    ),
    Quantity(
        "wrap_angle",
        "wrap_angle",
        ("cable",),
        "rad",
        "angle over which the cable lies on its pulley",
        known=Known.SOLVED,
        low=0.0,
    ),
    Quantity(
        "wrapped_length",
        "state.contact.wrapped_length",
        ("cable",),
        "m",
        "unstrained length on the pulley",
        known=Known.SOLVED,
        low=0.0,
    ),
    Quantity(
        "dead_length",
        "state.contact.dead_length",
        ("cable",),
        "m",
        "unstrained length between pulley and drum",
        known=Known.SOLVED,
        low=0.0,
    ),
    Quantity(
        "chord_sine",
        "state.contact.chord_sine",
        ("cable",),
        "1",
        "sine of the slope of the chord that touches the pulley",
        known=Known.SOLVED,
    ),
)

# of one whose friction counts
WINDING = Quantity(
    "winding",
    "state.contact.winding",
    ("cable",),
    "1",
    "direction of friction: 1 winding in, -1 paying out, 0 standing",
    low=-1.0,
)

# of a plan that has them: one of a file written before they were kept has none. A proof more is a line here.
PROOF = (
    Quantity(
        "farkas",
        "farkas",
        ("wrench_part",),
        "1, 1/m",
        "vector y that proves a pose infeasible: along it the cables give less than is needed, at any tensions",
        known=Known.SOMEWHERE,
    ),
    Quantity(
        "needed",
        "needed",
        ("wrench_part",),
        "N, N m",
        "wrench J tau that the chord tensions must supply",
        known=Known.SOMEWHERE,
    ),
    Quantity(
        "bracket",
        "bracket",
        ("bracket_part",),
        "N",
        "what is proved and what suffices of the smallest change of the force that would make the pose feasible",
        known=Known.SOMEWHERE,
        low=0.0,
        infinite=True,
    ),
    Quantity(
        "relief",
        "relief",
        ("axis",),
        "N",
        "smallest force that, added to the wrench, makes the pose feasible",
        known=Known.SOMEWHERE,
    ),
    Quantity(
        "at_border",
        "at_border",
        (),
        "",
        "whether the tensions were searched for at the border of feasibility, where the way of sharing had no say",
        values=bool,
    ),
)

# of a path only
TIME = Quantity("time", "path.time", (), "s", "time from the start of the path")
MOTION = (
    Quantity("twist", "path.twist", ("twist_part",), "m/s, rad/s", "velocity of the platform origin, angular velocity"),
    Quantity(
        "twist_rate",
        "path.twist_rate",
        ("twist_part",),
        "m/s^2, rad/s^2",
        "acceleration of the platform origin, angular acceleration",
    ),
)
# of a path whose jerk is known
JERK = Quantity("jerk", "path.jerk", ("twist_part",), "m/s^3, rad/s^3", "rate of twist_rate")
