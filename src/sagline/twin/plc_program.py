"""Program of the PLC of one group: ownership, heartbeat, ramp, limits and hold."""

# The SCL source has the same statements in the same order. The program uses plain numbers, so that a scan takes
# microseconds.

from __future__ import annotations

from math import isfinite
from typing import Final, NamedTuple

from sagline.control.link import (
    HEARTBEAT,
    OWNER_TIMEOUT,
    PERIOD,
    RAMP,
    GroupFault,
    GroupStatus,
    Mode,
    WinchState,
    newer,
)

FOLLOWING: Final = 0.01  # largest distance between set point and encoder [m]; the controller stops at half of it
TINY: Final = 1e-9  # tolerance for rounding [m] and [s]
LEFT: Final = 0.1  # shortest free cable [m]

# plain numbers, because Python compares members of an enumeration ten times slower
_EMERGENCY: Final = int(GroupStatus.EMERGENCY | GroupStatus.LOCKED | GroupStatus.BRAKED)
_LOCKED: Final = int(GroupStatus.READY | GroupStatus.LOCKED | GroupStatus.BRAKED)
_READY, _BRAKED, _RAMPING = int(GroupStatus.READY), int(GroupStatus.BRAKED), int(GroupStatus.RAMPING)
_HOLDING, _FOLLOWING = int(GroupStatus.HOLDING), int(GroupStatus.FOLLOWING)
_LEAVE, _HOLD, _FOLLOW, _LOCK = (int(mode) for mode in (Mode.LEAVE, Mode.HOLD, Mode.FOLLOW, Mode.LOCK))


class Order(NamedTuple):
    """Command to one PLC: values for the winches of its group."""

    counter: int
    owner: int
    mode: int
    valid_for: float
    length: list[float]
    rate: list[float]
    tension: list[float]
    enable: list[bool]


class PlcLimits(NamedTuple):
    """Limits of the winches of a PLC."""

    least: list[float]  # shortest set points [m]
    most: list[float]  # longest set points [m]
    speed: list[float]  # largest rates [m/s]
    tension: list[float]  # largest tensions during winding in, and largest expected tensions [N]


class Program:
    """Program of one group. Inputs: command, encoders and load cells. Outputs: the attributes."""

    def __init__(self, limits: PlcLimits, period: float) -> None:
        """Begin with brakes on and without an owner. `period`: period of a scan [s]."""
        self.limits, self.period = limits, period
        count = len(limits.least)
        self.winches = range(count)
        # owner: id of the controller that owns the group, 0 for none
        # echo: counter of the last accepted command, 0 before the first command
        # fault: reason of an automatic stop. A command to hold clears it after the end of the ramp, at the earliest
        # after 100 ms.
        self.owner, self.echo, self.fault = 0, 0, GroupFault.NONE
        self.powered = [False] * count  # True for each drive that has power and a released brake
        self._loaded = [False] * count  # True for each drive that produces the expected tension
        # length: set points at the end of the scan's period [m]
        # tension: expected tensions at the drums [N]
        self.length, self.tension = [0.0] * count, [0.0] * count
        self.drive_fault = [0] * count  # fault codes of the drives, 0 for none
        # contact: state of the normally closed contact of the emergency stop: False if the stop is pressed, or if the
        # wire is broken
        # emergency: True after the contact has opened, until a reset with a closed contact
        # locked: True if the drums are locked until the operator releases them
        self.contact, self.emergency, self.locked = True, False, False
        self._order: Order | None = None
        self._fresh = False
        self._moved = -OWNER_TIMEOUT  # time of the last change of the command counter [s]
        self._target = [0.0] * count  # set points of the last command, or present lengths of the drives [m]
        self._rate = [0.0] * count
        self._ramp = 0.0  # remaining time of the ramp [s]
        self._left = 0.0  # remaining time [s] until the set points of the last command are reached
        self._now = self._since = 0.0  # times of this scan, and of the scan of the fault [s]
        self._mode = _LEAVE

    def claim(self, owner: int, now: float) -> None:
        """Set an owner if none exists or the owner's counter has not changed for OWNER_TIMEOUT. `now`: time [s]."""
        if owner > 0 and owner != self.owner and (not self.owner or now - self._moved >= OWNER_TIMEOUT - TINY):
            self.seize(owner, now)

    def seize(self, owner: int, now: float) -> None:
        """Set a new owner without conditions."""
        self.owner, self.echo, self._moved = owner, 0, now
        self._order, self._fresh = None, False
        if any(self._rate) and not self._ramp:
            self._stop(GroupFault.HEARTBEAT)

    def take(self, order: Order) -> None:
        """Accept the command `order` if the owner sent it and it is newer than the last command."""
        if self.owner and order.owner == self.owner and (not self.echo or newer(order.counter, self.echo)):
            self.echo, self._order, self._fresh = order.counter, order, True

    def reset(self) -> None:
        """Release the drums and clear the drive faults, as an operator does. The brakes remain on."""
        self.emergency = self.locked = False
        self.drive_fault = [0] * len(self.drive_fault)
        self.fault, self._order = GroupFault.NONE, None
        self._brake()

    def restart(self) -> None:
        """Restart the PLC, with brakes on and without an owner."""
        self.owner, self.echo, self._order, self._fresh = 0, 0, None, False
        self.fault = GroupFault.NONE
        self._brake()

    def trip(self, winch: int, code: int) -> None:
        """Trip a drive, which then has no power until the operator resets it."""
        self.drive_fault[winch], self.powered[winch] = code, False
        self._stop(GroupFault.DRIVE)

    def scan(self, now: float, encoder: list[float], cell: list[float]) -> None:
        """Set the drives for the next period. `now`: time [s]. `encoder`: lengths [m]. `cell`: tensions [N]."""
        order, fresh, waited, self._now = self._order, self._fresh, now - self._moved, now
        self.emergency = self.emergency or not self.contact
        if fresh and order is not None:
            self._fresh, self._moved = False, now
            stands = self.fault or self.emergency or self.locked
            if order.mode == _FOLLOW and order.enable == self.powered and not stands and not self._lags(encoder):
                self._follow(order, waited, cell)
                return
            if order.mode == _LEAVE:
                self.owner, self._order = 0, None
                self.fault = GroupFault.NONE
                self._brake()
            elif order.mode == _LOCK:
                self.locked = True
        if self.emergency or self.locked:
            self.fault = GroupFault.EMERGENCY_STOP if self.emergency else self.fault
            self._brake()
            return
        if self._lags(encoder):
            if self.fault == GroupFault.FOLLOWING_ERROR:  # without power, set points are the positions of the drives
                self.locked = True
                self._brake()
                return
            self._move_to_drives(encoder, cell)
            self._stop(GroupFault.FOLLOWING_ERROR)
            self.fault = GroupFault.FOLLOWING_ERROR  # this fault replaces an earlier fault
        if any(self.drive_fault):
            self.fault = self.fault or GroupFault.DRIVE
        elif fresh and order is not None and (not self.fault or (order.mode == _HOLD and self._was_reported)):
            self.fault = GroupFault.NONE
            if order.enable != self.powered:
                self._switch(order, encoder)
                waited = 0.0  # a drive starts at its set point
            self._obey(order, waited, cell)
            return
        elif order is not None and waited >= min(HEARTBEAT, order.valid_for) - TINY:
            self._stop(GroupFault.HEARTBEAT)
        elif self._mode == _FOLLOW and not self.fault:
            self._drive(cell)
            return
        self._slow_down(cell)

    def _lags(self, encoder: list[float]) -> bool:
        """True if a drive is too far from its set point."""
        length, powered = self.length, self.powered
        for i in self.winches:
            if powered[i] and not -FOLLOWING <= length[i] - encoder[i] <= FOLLOWING:
                break
        else:
            return False
        return True

    def _move_to_drives(self, encoder: list[float], cell: list[float]) -> None:
        """Replace each set point that is too far from its drive, by position of the drive and tension of the cell."""
        read = self._valid_tensions([max(reading, 0.0) for reading in cell])
        self.length, self._rate, self.tension = list(self.length), list(self._rate), list(self.tension)
        for i in self.winches:
            if self.powered[i] and abs(self.length[i] - encoder[i]) > FOLLOWING:
                self.length[i], self._rate[i], self.tension[i] = encoder[i], 0.0, read[i]

    def _brake(self) -> None:
        """Cut the power of all drives, so that their brakes engage."""
        self.powered = [False] * len(self.powered)
        self._loaded = list(self.powered)
        self._rate, self._ramp, self._mode = [0.0] * len(self._rate), 0.0, _LEAVE

    def _switch(self, order: Order, encoder: list[float]) -> None:
        """Switch on the enabled drives at their present lengths, and switch off all others."""
        # A drive first produces the expected tension. The next command releases its brake.
        self.length, self._target, self._rate = list(self.length), list(self._target), list(self._rate)
        for i in self.winches:
            has = order.enable[i] and (self.powered[i] or self._loaded[i])
            if has and not self.powered[i]:
                self.length[i] = self._target[i] = encoder[i]
            if not has or not self.powered[i]:
                self._rate[i] = 0.0
            self.powered[i] = has
        self._loaded = order.enable

    def _obey(self, order: Order, waited: float, cell: list[float]) -> None:
        if order.mode == _FOLLOW and any(self.powered):
            self._follow(order, waited, cell)
            return
        known = self._valid_tensions(order.tension)  # the tension of a holding drive does not change
        self.tension = [old if has else new for has, old, new in zip(self.powered, self.tension, known, strict=True)]
        if self._mode == _FOLLOW and any(self._rate):
            self._ramp = RAMP
        self._mode = order.mode
        self._slow_down(cell)

    def _valid_tensions(self, tension: list[float]) -> list[float]:
        """Set the expected tensions. The previous tension replaces a tension outside the limits."""
        rows = zip(tension, self.tension, self.limits.tension, strict=True)
        return [new if 0.0 <= new <= most and isfinite(new) else old for new, old, most in rows]

    def _follow(self, order: Order, waited: float, cell: list[float]) -> None:
        """Follow new set points if their lengths, steps, rates and tensions are within limits."""
        least, most, speed, tightest = self.limits
        lengths, rates, tensions, before = order.length, order.rate, order.tension, self._target
        self._mode, self._ramp = _FOLLOW, 0.0
        waited = max(waited, 0.0) + PERIOD  # the previous command may have been late
        for i in self.winches:
            length, fastest = lengths[i], speed[i]
            if self.powered[i]:
                far = fastest * waited + TINY
                if not (
                    least[i] <= length <= most[i]
                    and -far <= length - before[i] <= far
                    and -fastest - TINY <= rates[i] <= fastest + TINY
                    and 0.0 <= tensions[i] <= tightest[i]
                    and isfinite(tensions[i])
                ):
                    self._stop(GroupFault.SET_POINT)
                    self._slow_down(cell)
                    return
            elif not 0.0 <= tensions[i] <= tightest[i]:
                tensions = self._valid_tensions(tensions)
        self.tension, self._target, self._rate, self._left = tensions, lengths, rates, PERIOD
        self._drive(cell)

    def _drive(self, cell: list[float]) -> None:
        """Advance the set points by a scan. A cable beyond its tension limit is not wound in."""
        # Within one cycle, the set points move linearly to those of the last command. After the cycle, the set points
        # continue at the rates of the command. Lengths and rates stay within their limits.
        limit, length, powered, target, rate = self.limits.tension, self.length, self.powered, self._target, self._rate
        left, period, moved = self._left, self.period, []
        beyond = max(period - left, 0.0)
        for i in self.winches:
            at = length[i]
            if powered[i]:
                if left <= TINY:
                    at += rate[i] * period
                elif left > period + TINY:
                    at += (target[i] - at) * period / left
                else:
                    at = target[i] + rate[i] * beyond
                at = self._within_limits(i, at)
                if not cell[i] <= limit[i] and at < length[i]:  # the condition is True for NaN
                    self._stop(GroupFault.OVER_TENSION)
                    self._slow_down(cell)
                    return
            moved.append(at)
        self.length, self._left = moved, max(left - period, 0.0)

    def _within_limits(self, i: int, length: float) -> float:
        """Next set point of a winch, with a limited rate. Out of range, a set point may move only toward the range."""
        at, farthest = self.length[i], self.limits.speed[i] * self.period + TINY
        if length > at + farthest:
            length = at + farthest
        elif length < at - farthest:
            length = at - farthest
        least, most = self.limits.least[i], self.limits.most[i]
        if least <= length <= most:
            return length
        return min(max(length, min(least, at)), max(most, at))

    def _stop(self, fault: GroupFault) -> None:
        """Begin to slow down because of a fault, and hold afterwards."""
        if not self.fault:
            self.fault, self._since = fault, self._now
            self._ramp = RAMP if any(self._rate) and not self._ramp else self._ramp

    def _slow_down(self, cell: list[float]) -> None:
        """Reduce the rates linearly to zero. A cable beyond its tension limit is not wound in."""
        if self._ramp <= 0.0:
            return
        share, period = self._ramp / RAMP, min(self.period, self._ramp)
        mean = period * (share - 0.5 * period / RAMP)
        self._ramp = self._ramp - period if self._ramp - period > TINY else 0.0
        self.length = list(self.length)
        for i in self.winches:
            if self.powered[i] and (cell[i] <= self.limits.tension[i] or self._rate[i] >= 0.0):
                self.length[i] = self._within_limits(i, self.length[i] + self._rate[i] * mean)
        self._target = list(self.length)
        if not self._ramp:
            self._rate = [0.0] * len(self._rate)

    @property
    def _was_reported(self) -> bool:
        """True if the ramp has ended and the fault has been reported for at least the heartbeat time."""
        return not self._ramp and self._now - self._since >= HEARTBEAT - TINY

    @property
    def status(self) -> int:
        """Bits of `GroupStatus`."""
        if self.emergency:
            return _EMERGENCY
        if self.locked:
            return _LOCKED
        ready = 0 if any(self.drive_fault) else _READY
        if not any(self.powered):
            return ready | _BRAKED
        if self._ramp > 0.0:
            return ready | _RAMPING
        if self.fault:
            return ready | _HOLDING
        return ready | _FOLLOWING if self._mode == _FOLLOW else ready

    def states(self, saturated: list[float]) -> tuple[list[int], list[int]]:
        """Codes of `WinchState`, from the drives' fault codes and from `saturated`, the flags of drives at a limit."""
        states = [WinchState.SATURATED if full else WinchState.ENABLED for full in saturated]
        for i in self.winches:
            if self.drive_fault[i]:
                states[i] = WinchState.FAULT
            elif self.emergency or self.locked:
                states[i] = WinchState.LOCKED
            elif not self.powered[i]:
                states[i] = WinchState.BRAKED
        return list(map(int, states)), self.drive_fault
