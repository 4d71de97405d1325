"""What the page asks of the dynamics, with what it assumes."""

from __future__ import annotations

from typing import Any, Final

from sagline.dynamics.damping import Damping
from sagline.dynamics.events import Break
from sagline.dynamics.simulate import simulate
from sagline.dynamics.simulation import Simulation
from sagline.dynamics.vibrating import vibration
from sagline.dynamics.vibration import Vibration
from sagline.robot.equilibrium import Equilibrium

DAMPING: Final = Damping(modal_damping=0.01)
LOSSES: Final = Damping(loss_time=1e-3)
BEFORE, AFTER = 0.25, 4.0  # s of a simulation before and after the cut
NODES = 10  # of a cable with mass: four times as fast as twice as many


def vibrating(state: Equilibrium, up_to: float) -> Vibration:
    """All modes below a frequency [Hz]."""
    return vibration(state, up_to=up_to, damping=DAMPING)


def cut(state: Equilibrium, cable: int, cable_mass: Any) -> Simulation:
    """What follows when a cable breaks; the others keep their lengths."""
    events = (Break(cable=cable, time=BEFORE),)
    duration = BEFORE + AFTER
    return simulate(state, duration=duration, cable_mass=cable_mass, nodes=NODES, events=events, damping=LOSSES)
