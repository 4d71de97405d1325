"""What stands in a simulation's file: each variable, where the simulation keeps it, its dimensions and its unit."""

from __future__ import annotations

from typing import Final

from sagline.files.variables import Known, Quantity

TIME: Final = Quantity("time", "time", (), "s", "time")
# of every sample; a cable that broke has no length any more, and no nodes
SAMPLES: Final = (
    Quantity("position", "pose.position", ("axis",), "m", "position of the platform origin in the world"),
    Quantity(
        "quaternion", "pose.quaternion", ("quaternion_part",), "1", "rotation from platform to world, scalar last"
    ),
    Quantity("twist", "twist", ("twist_part",), "m/s, rad/s", "velocity of the platform origin, angular velocity"),
    Quantity("tensions", "tensions", ("cable",), "N", "tension at the frame end", low=0.0),
    Quantity(
        "length",
        "length",
        ("cable",),
        "m",
        "unstrained length off the drum; none once broken",
        known=Known.SOMEWHERE,
        low=0.0,
    ),
    Quantity("kinetic_energy", "energy.kinetic", (), "J", "kinetic energy", low=0.0),
    Quantity("potential_energy", "energy.potential", (), "J", "energy of weight and strain"),
    Quantity("energy_supplied", "energy.supplied", (), "J", "work done on the robot since the start"),
    Quantity("energy_lost", "energy.lost", (), "J", "work of damping and friction since the start"),
    Quantity("energy_removed", "energy.removed", (), "J", "energy that left with broken cables and dropped loads"),
    Quantity("energy_error", "energy.error", (), "J", "what the integrator has invented since the start"),
)
# of every cable, where it is known
LARGEST: Final = Quantity(
    "largest_tension", "largest_tension", ("cable",), "N", "largest tension at the frame end at any step", low=0.0
)
# of cables with mass
NODES: Final = Quantity(
    "node_position",
    "nodes",
    ("cable", "node", "axis"),
    "m",
    "position of the cables at their nodes",
    known=Known.SOMEWHERE,
)
# one a row of what happened; a place is that of one occurrence
EVENTS: Final = (
    Quantity("event_time", "time", (), "s", "when it happened"),
    Quantity("event_kind", "kind", (), "", "what happened", values=str),
    Quantity("event_cable", "cable", (), "", "which cable or winch, counted from 0; -1 for the platform", values=int),
    Quantity(
        "event_tension_before", "tension_before", (), "N", "largest tension before it", known=Known.SOMEWHERE, low=0.0
    ),
    Quantity(
        "event_tension_after", "tension_after", (), "N", "largest tension after it", known=Known.SOMEWHERE, low=0.0
    ),
)
NO_CABLE: Final = -1
CABLE_MASS: Final = ("none", "lumped", "modal")
INTEGRATORS: Final = ("splitting", "runge-kutta", "exact")
WINDINGS: Final = ("constant", "remembered")
LAGGING: Final = "second-order"
WINCHES: Final = ("ideal", "robot", LAGGING)
# attributes that are numbers, and their units
STEP: Final = {"step": "s"}
LAG: Final = {"bandwidth": "Hz", "damping_ratio": "1"}
LOSSES: Final = {"loss_time": "s", "air_damping": "N s/m^2", "modal_damping": "1"}
# what happens to a cable or winch, to the platform, and to either
OF_CABLES: Final = ("break", "stall", "saturate", "slack")
OF_PLATFORM: Final = ("drop", "pick up")
OF_EITHER: Final = ("brake",)
