"""A cable with mass as a chain: nodes are material points, and elements between them transmit only tension.

docs/model.md, section 11. Node 0 is the platform end, and the last node is the frame end. Nodes are therefore added and
removed at the end of the arrays. All elements have the same unstrained length, except the element at the frame, which
has the remaining length. Each element adds half of its mass to each of its two nodes. Mass at node 0 is part of the
platform. A piece of a broken cable is also a chain: its node at the break is free and has the mass of half an element.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.jit import formula, kernel


@formula
def wind_across(wind: Array, along: float, x: float, y: float, z: float, drag: float) -> tuple[float, float, float]:
    """Force [N] of the wind on a line; it is normal to the line."""
    # wind: velocity of the air [m/s], (3,); along: wind component along the line (x, y, z), divided by its length;
    # drag: force per square of the speed normal to the line [N s^2/m^2].
    nx, ny, nz = wind[0] - along * x, wind[1] - along * y, wind[2] - along * z
    size = drag * math.sqrt(nx * nx + ny * ny + nz * nz)
    return size * nx, size * ny, size * nz


# columns of the chain table, a row for each cable
EXIT_X, EXIT_Y, EXIT_Z = 0, 1, 2  # exit point of the chain, world axes [m]
ELEMENT = 3  # unstrained length of an element [m]
DENSITY, STIFFNESS = 4, 5  # [kg/m], [N]
LOSS_TIME = 6  # [s]
AIR_RATE = 7  # damping force of the air per velocity and mass of the cable [1/s]
BEHIND, RUN = 8, 9  # cable between drum and exit point: unstrained length, and length of the path [m]
WIND = 10  # force of the wind per length and square of the speed [N s^2/m^3]
SMOOTH = 11  # weight of a new value in the filtered mean tension, which detects a slack cable
GRAVITY = 12  # [m/s^2]
REST, RATE = 13, 14  # unstrained length of the element at the frame [m], and rate of paying out [m/s]
STEP = 15  # time step of the damping forces [s]
FREE_START, FREE_END = 16, 17  # 1 if the platform end or the frame end of the chain is free after a break, otherwise 0
CABLE, FIRST, POINTS = 18, 19, 20  # index of the cable; first index and number of its recorded points
CHAIN_COLUMNS = 21

LEAST, MOST = 0.4, 1.6  # limits of the length of the element at the frame, relative to the length of the other elements
TINY = 1e-300


@formula
def fill_element_forces(place: Array, speed: Array, count: int, row: Array, pulls: Array) -> float:
    """Fill the ratio force/length of every element [N/m]. Returns the power lost in the elements [W]."""
    # place: positions of the nodes [m], (3, nodes), node 0 at the platform and node count + 1 at the frame; speed:
    # velocities of the nodes [m/s], used if the elements have damping; pulls: filled, followed by three work rows, (4
    # nodes,).
    element, stiffness = row[ELEMENT], row[STIFFNESS]
    inverse = 1.0 / element
    for j in range(count):
        x = place[0, j + 1] - place[0, j]
        y = place[1, j + 1] - place[1, j]
        z = place[2, j + 1] - place[2, j]
        distance = math.sqrt(x * x + y * y + z * z)
        pulls[j] = max(stiffness * (distance * inverse - 1.0), 0.0) / (distance + TINY)
    distance = _element_distance(place, count)
    pulls[count] = max(stiffness * _strain_at_exit(row, distance), 0.0) / (distance + TINY)
    if row[LOSS_TIME] == 0.0:
        return 0.0
    return _add_damping(place, speed, count, row, pulls)


@formula
def _strain_at_exit(row: Array, distance: float) -> float:
    """Common strain of the element at the frame and of the freely sliding cable between this element and the drum."""
    return (distance + row[RUN]) / (row[REST] + row[BEHIND]) - 1.0


@formula
def _element_distance(place: Array, j: int) -> float:
    """Length of the element between node `j` and the next node toward the frame [m]."""
    x = place[0, j + 1] - place[0, j]
    y = place[1, j + 1] - place[1, j]
    z = place[2, j + 1] - place[2, j]
    return math.sqrt(x * x + y * y + z * z)


@formula
def _element_direction(place: Array, j: int, inverse: float) -> tuple[float, float, float, float]:
    """Unit vector from node `j` to the next node toward the frame, and the distance of both nodes, 1/`inverse` [m]."""
    x, y, z = place[0, j + 1] - place[0, j], place[1, j + 1] - place[1, j], place[2, j + 1] - place[2, j]
    return x * inverse, y * inverse, z * inverse, (x * x + y * y + z * z) * inverse


@formula
def _opening_speed(speed: Array, j: int, x: float, y: float, z: float) -> float:
    """Speed [m/s] of the next node toward the frame, relative to node `j` and along the unit vector (x, y, z)."""
    vx, vy, vz = speed[0, j + 1] - speed[0, j], speed[1, j + 1] - speed[1, j], speed[2, j + 1] - speed[2, j]
    return x * vx + y * vy + z * vz


@kernel
def _add_damping(place: Array, speed: Array, count: int, row: Array, pulls: Array) -> float:
    """Add damping forces to taut elements. The total force is never a compression. Returns the power lost [W]."""
    # The forces follow from the speeds after the step (implicit Euler), so that damping does not limit the time step.
    # Each force changes the speeds of the element's two nodes, so that the forces solve a tridiagonal system. The
    # platform and the frame node keep their speeds. Elastic forces and weight also act on the other nodes. The power
    # holds for the mean speed during the step.
    size = place.shape[1]
    factors, values, inverses = pulls[size : 2 * size], pulls[2 * size : 3 * size], pulls[3 * size :]
    inner_rate = row[ELEMENT] / (row[STIFFNESS] * row[LOSS_TIME])  # rate of stretch per force [m/(N s)]
    last_rate = (row[REST] + row[BEHIND]) / (row[STIFFNESS] * row[LOSS_TIME])
    start = 2.0 * row[FREE_START] * row[STEP] / (row[DENSITY] * row[ELEMENT])
    end = 2.0 * row[FREE_END] * row[STEP] / (row[DENSITY] * row[REST])
    inner = row[STEP] / (row[DENSITY] * row[ELEMENT])
    last = row[STEP] / (0.5 * row[DENSITY] * (row[ELEMENT] + row[REST]))
    fall = row[GRAVITY] * row[STEP]
    for j in range(count + 1):
        inverses[j] = 1.0 / (_element_distance(place, j) + TINY)
    # directions and elastic forces of the elements before, at and after j
    bx = by = bz = before = 0.0
    ax = ay = az = after = 0.0
    x, y, z, distance = _element_direction(place, 0, inverses[0])
    force = pulls[0] * distance
    inverse = 1.0  # reciprocal of the diagonal of the row before, after elimination
    value = 0.0  # right side of this row
    for j in range(count + 1):
        near = start if j == 0 else (last if j == count else inner)
        far = end if j == count else (last if j == count - 1 else inner)
        after = 0.0
        if j < count:
            ax, ay, az, distance = _element_direction(place, j + 1, inverses[j + 1])
            after = pulls[j + 1] * distance
        back, ahead = bx * x + by * y + bz * z, ax * x + ay * y + az * z
        opening = _opening_speed(speed, j, x, y, z)
        opening += far * (after * ahead - force) - near * (force - before * back)
        if j == 0 and start == 0.0:  # the weight acts on both nodes of the other elements
            opening -= fall * z
        elif j == count and end == 0.0:
            opening += fall * z
        coupling = -near * back if force > 0.0 and before > 0.0 else 0.0
        factor = coupling * inverse
        inverse = 1.0 / ((last_rate if j == count else inner_rate) + near + far - coupling * factor)
        value = (opening - coupling * value) * inverse if force > 0.0 else 0.0
        factors[j], values[j] = factor, value
        bx, by, bz, before = x, y, z, force
        x, y, z, force = ax, ay, az, after
    power = 0.0
    force = 0.0
    for k in range(count + 1):
        j = count - k
        factor = factors[j + 1] if k > 0 else 0.0
        force = values[j] - factor * force
        x, y, z, distance = _element_direction(place, j, inverses[j])
        # the frame node has the velocity of the entering cable, which includes the change of the rest length
        opening = _opening_speed(speed, j, x, y, z)
        elastic = pulls[j]
        pulls[j] = max(elastic + force * inverses[j], 0.0) if elastic > 0.0 else 0.0
        power += (pulls[j] - elastic) * distance * 0.5 * (opening + force * (last_rate if j == count else inner_rate))
    return power


@formula
def fill_frame_node_velocity(place: Array, speed: Array, count: int, row: Array) -> None:
    """Fill the velocity of the frame node, which is L' (1 + strain) along the cable, unless the node is free."""
    if row[FREE_END] > 0.0:
        return
    for c in range(3):
        speed[c, count + 1] = row[RATE] * (place[c, count] - place[c, count + 1]) / row[REST]


@formula
def kick_nodes(place: Array, speed: Array, count: int, row: Array, pulls: Array, h: float) -> None:
    """Update the nodes' velocities by element forces, gravity and the momentum of entering cable, during `h` [s]."""
    share = h / (row[DENSITY] * row[ELEMENT])
    last = h / (0.5 * row[DENSITY] * (row[ELEMENT] + row[REST]))
    for c in range(3):
        fall = row[GRAVITY] * h if c == 2 else 0.0
        for j in range(1, count):
            there = pulls[j] * (place[c, j + 1] - place[c, j])
            back = pulls[j - 1] * (place[c, j] - place[c, j - 1])
            speed[c, j] += share * (there - back) - fall
        there = pulls[count] * (place[c, count + 1] - place[c, count])
        back = pulls[count - 1] * (place[c, count] - place[c, count - 1])
        entering = 0.5 * row[DENSITY] * row[RATE] * speed[c, count + 1]
        speed[c, count] += last * (there - back + entering) - fall
        if row[FREE_START] > 0.0:
            speed[c, 0] += 2.0 * share * pulls[0] * (place[c, 1] - place[c, 0]) - fall
        if row[FREE_END] > 0.0:
            speed[c, count + 1] -= 2.0 * h / (row[DENSITY] * row[REST]) * there + fall


@formula
def drift_nodes(place: Array, speed: Array, count: int, row: Array, before: float, h: float) -> None:
    """Move the nodes for `h` [s]. The node next to the frame keeps its momentum while its mass changes."""
    # `place`: positions of the nodes [m]. `speed`: their velocities [m/s]. `before`: unstrained length of the element
    # at the frame before the motion [m]. `row`: row of the cable, with this length after the motion. `h`: time [s].
    old, new = row[ELEMENT] + before, row[ELEMENT] + row[REST]
    middle = 0.5 * (old + new)
    for c in range(3):
        for j in range(1, count):
            place[c, j] += h * speed[c, j]
        momentum = speed[c, count] * old
        place[c, count] += h * momentum / middle
        speed[c, count] = momentum / new
        if row[FREE_START] > 0.0:
            place[c, 0] += h * speed[c, 0]
        if row[FREE_END] > 0.0:
            place[c, count + 1] += h * speed[c, count + 1]


@formula
def _first_node(row: Array) -> int:
    """Index of the first node that the chain moves; node 0 moves with the platform, unless it is free."""
    return 0 if row[FREE_START] > 0.0 else 1


@formula
def _last_node(count: int, row: Array) -> int:
    """Index of the last node that the chain moves; node count + 1 is at the frame, unless it is free."""
    return count + 1 if row[FREE_END] > 0.0 else count


@kernel
def slow_by_air(speed: Array, count: int, row: Array, h: float) -> float:
    """Apply the damping of the air to the nodes for `h` [s]. Returns the energy lost [J]."""
    if row[AIR_RATE] == 0.0:
        return 0.0
    factor = math.exp(-row[AIR_RATE] * h)
    before = kinetic(speed, count, row)
    for c in range(3):
        for j in range(_first_node(row), _last_node(count, row) + 1):
            speed[c, j] *= factor
    return (1.0 - factor * factor) * before


@kernel
def kinetic(speed: Array, count: int, row: Array) -> float:
    """Kinetic energy of the free nodes [J]."""
    inner = 0.0
    last = 0.0
    ends = 0.0
    for c in range(3):
        for j in range(1, count):
            inner += speed[c, j] * speed[c, j]
        last += speed[c, count] * speed[c, count]
        ends += row[FREE_START] * row[ELEMENT] * speed[c, 0] * speed[c, 0]
        ends += row[FREE_END] * row[REST] * speed[c, count + 1] * speed[c, count + 1]
    return 0.5 * row[DENSITY] * (row[ELEMENT] * inner + 0.5 * (row[ELEMENT] + row[REST]) * last + 0.5 * ends)


@kernel
def kinetic_at_exit(speed: Array, count: int, row: Array) -> float:
    """Kinetic energy of the half element that enters at the frame [J]."""
    square = speed[0, count + 1] ** 2 + speed[1, count + 1] ** 2 + speed[2, count + 1] ** 2
    return 0.25 * row[DENSITY] * row[REST] * square


@kernel
def potential(place: Array, count: int, row: Array) -> tuple[float, float]:
    """Strain energy [J], and potential energy of the free nodes above the exit [J]."""
    element, stiffness = row[ELEMENT], row[STIFFNESS]
    stretch = 0.0
    height = 0.0
    for j in range(count):
        more = max(_element_distance(place, j) - element, 0.0)
        stretch += more * more
    for j in range(1, count):
        height += place[2, j] - row[EXIT_Z]
    last = row[REST] + row[BEHIND]
    more = max(_strain_at_exit(row, _element_distance(place, count)), 0.0) * last
    strain = 0.5 * stiffness * (stretch / element + more * more / last)
    above = element * height + 0.5 * (element + row[REST]) * (place[2, count] - row[EXIT_Z])
    above += 0.5 * row[FREE_START] * element * (place[2, 0] - row[EXIT_Z])
    above += 0.5 * row[FREE_END] * row[REST] * (place[2, count + 1] - row[EXIT_Z])
    return strain, row[DENSITY] * row[GRAVITY] * above


@kernel
def whole_force(place: Array, speed: Array, count: int, row: Array, pulls: Array) -> float:
    """Energy per length paid out [N] that the chain loses: H = T + T^2/(2 EA) - w z minus kinetic energy per length."""
    # While cable is paid out, the sum of `kinetic` and `potential` changes at the rate -H times the rate of the length.
    distance = _element_distance(place, count)
    strain = max(_strain_at_exit(row, distance), 0.0)
    elastic = row[STIFFNESS] * strain
    viscous = pulls[count] * distance - elastic
    density = row[DENSITY]
    square = 0.0
    with_entering = 0.0
    for c in range(3):
        square += speed[c, count] * speed[c, count]
        with_entering += speed[c, count] * (place[c, count] - place[c, count + 1])
    with_entering *= row[RATE] / row[REST]
    height = place[2, count] - row[EXIT_Z]
    moving = 0.5 * density * (with_entering - 0.5 * square + row[GRAVITY] * height)
    return elastic * (1.0 + 0.5 * strain) + viscous * distance / row[REST] - moving


@kernel
def tension_at_exit(place: Array, count: int, row: Array, pulls: Array) -> float:
    """Tension at the chain's exit point [N]: force of its last element plus half the weight of this element."""
    x = pulls[count] * (place[0, count + 1] - place[0, count])
    y = pulls[count] * (place[1, count + 1] - place[1, count])
    z = pulls[count] * (place[2, count + 1] - place[2, count]) + 0.5 * row[DENSITY] * row[GRAVITY] * row[REST]
    return math.sqrt(x * x + y * y + z * z)


@formula
def mean_tension(pulls: Array, count: int, row: Array) -> float:
    """Mean tension of the elements [N], which detects a slack cable. Waves do not change the mean."""
    total = 0.0
    for j in range(count + 1):
        total += pulls[j]
    return total * row[ELEMENT] / (count + 1)


@kernel
def insert_node(place: Array, speed: Array, count: int, row: Array) -> None:
    """Insert a node in the element at the frame, one element length from its free end."""
    # The caller updates the counts. Tension, mass and momentum, including the half element at the frame, do not change.
    # Without cable between exit point and drum, position and velocity are linear along the element, and the center of
    # mass does not change.
    rest, rate = row[REST], row[RATE]
    distance, left = _element_distance(place, count), rest - row[ELEMENT]
    share = 1.0 - row[ELEMENT] * (1.0 + _strain_at_exit(row, distance)) / (distance + TINY)
    share = min(max(share, 0.0), 1.0)
    for c in range(3):
        exit_place, exit_speed = place[c, count + 1], speed[c, count + 1]
        born = exit_place + share * (place[c, count] - exit_place)
        entering = rate * (born - exit_place) / left
        place[c, count + 2], speed[c, count + 2] = exit_place, entering
        place[c, count + 1] = born
        speed[c, count + 1] = (left * (speed[c, count] - entering) + rest * exit_speed) / rest


@kernel
def merge_nodes(place: Array, speed: Array, count: int, row: Array) -> None:
    """Merge the element at the frame with its neighbor and remove the node between both."""
    # The caller updates the counts. The next node takes the momentum of the removed node. The half element at the frame
    # moves with the entering cable, so that its momentum is subtracted.
    element, rest, rate = row[ELEMENT], row[REST], row[RATE]
    whole = element + rest
    for c in range(3):
        exit_place = place[c, count + 1]
        entering = rate * (place[c, count - 1] - exit_place) / whole
        # in units of half the density
        momentum = rest * speed[c, count + 1] + whole * speed[c, count] + 2.0 * element * speed[c, count - 1]
        speed[c, count - 1] = (momentum - whole * entering) / (element + whole)
        place[c, count], speed[c, count] = exit_place, entering


@formula
def wind_on_element(place: Array, j: int, k: int, drag: float, wind: Array) -> tuple[float, float, float]:
    """Force [N] of the wind on the line between nodes j and k; drag: force per square of the speed [N s^2/m^2]."""
    x, y, z = place[0, k] - place[0, j], place[1, k] - place[1, j], place[2, k] - place[2, j]
    along = (wind[0] * x + wind[1] * y + wind[2] * z) / (x * x + y * y + z * z + TINY)
    return wind_across(wind, along, x, y, z, drag)


@kernel
def add_wind_on_nodes(place: Array, speed: Array, count: int, row: Array, wind: Array, h: float) -> float:
    """Update the nodes' velocities by the wind across the cable, during `h` [s]. Returns the work of the wind [J]."""
    work = 0.0
    for j in range(_first_node(row), _last_node(count, row) + 1):
        below = row[ELEMENT] if j <= count else row[REST]
        above = row[ELEMENT] if j < count else row[REST]
        length = 0.5 * ((below if j > 0 else 0.0) + (above if j <= count else 0.0))
        x, y, z = wind_on_element(place, max(j - 1, 0), min(j + 1, count + 1), length * row[WIND], wind)
        share = h / (row[DENSITY] * length)
        along = x * (speed[0, j] + 0.5 * share * x) + y * (speed[1, j] + 0.5 * share * y)
        work += h * (along + z * (speed[2, j] + 0.5 * share * z))
        speed[0, j] += share * x
        speed[1, j] += share * y
        speed[2, j] += share * z
    return work
