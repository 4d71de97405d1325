"""Hidden parts of a drawing, compared point by point with rays toward the viewer and other formulas."""

from itertools import combinations, pairwise, product

import numpy as np
import pytest

from sagline.core.arrays import Array
from sagline.plot.geometry import ALONG, FlatLine, view_axes, visible_parts
from tests.tiers import wide

HALF, GAP = 0.02, 0.05
NEAR = 1e-3  # from the beginning of a hidden part, where both results are correct


def box_faces(middle: Array, size: Array, turn: Array) -> list[Array]:
    """Corners of the six faces of a box, in order around each."""
    faces = []
    for axis, side in product(range(3), (-1.0, 1.0)):
        one, other = [k for k in range(3) if k != axis]
        corners = np.zeros((4, 3))
        corners[:, axis] = side
        corners[:, one], corners[:, other] = (-1.0, 1.0, 1.0, -1.0), (-1.0, -1.0, 1.0, 1.0)
        faces.append(middle + 0.5 * size * corners @ turn.T)
    return faces


def ray_meets_box(start: Array, toward: Array, middle: Array, size: Array, turn: Array) -> bool:
    """Kay and Kajiya 1986: intervals between pairs of planes in the axes of the box."""
    begin, along = (start - middle) @ turn, toward @ turn
    with np.errstate(divide="ignore"):
        one, other = (-0.5 * size - begin) / along, (0.5 * size - begin) / along
    enter, leave = np.minimum(one, other).max(), np.maximum(one, other).min()
    return bool(enter < leave and leave > NEAR)


def passes(start: Array, toward: Array, one: Array, other: Array) -> tuple[float, float, float]:
    """Distance of a ray from a straight line, position along the ray, and position on the line, 0 to 1."""
    step, away = other - one, start - one
    matrix = np.array([[toward @ toward, -toward @ step], [toward @ step, -step @ step]])
    if abs(np.linalg.det(matrix)) < 1e-12:
        return np.inf, 0.0, 0.0
    along, share = np.linalg.solve(matrix, [-toward @ away, -step @ away])
    return float(np.linalg.norm(start + along * toward - one - share * step)), float(along), float(share)


def turned(generator: np.random.Generator) -> Array:
    turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    return np.asarray(turn * np.sign(np.linalg.det(turn)))


class Scene:
    """Curved lines through and around boxes, some of them with common points, seen from a direction."""

    def __init__(self, seed: int) -> None:
        generator = np.random.default_rng(seed)
        self.view = view_axes(*generator.uniform((-np.pi, 0.1), (np.pi, 1.4)))
        self.toward = self.view[2]
        self.boxes = [(generator.uniform(-1, 1, 3), generator.uniform(0.8, 1.8, 3), turned(generator)) for _ in "ab"]
        self.lines = []
        anchor = generator.uniform(-2, 2, 3)
        for number in range(7):
            start = anchor if number < 2 else generator.uniform(-2, 2, 3)
            share = np.linspace(0.0, 1.0, 6)[:, None]
            self.lines.append(
                start + share * (generator.uniform(-2, 2, 3) - start) - [0, 0, 0.4] * (share * (1.0 - share))
            )
        self.covers = [number != 6 for number in range(7)]  # the last hides nothing

    def parts(self) -> list[list[Array]]:
        drawn = [
            FlatLine(line @ self.view.T, *((HALF, GAP) if covers else (0.0, 0.0)))
            for line, covers in zip(self.lines, self.covers, strict=True)
        ]
        return visible_parts(drawn, [face @ self.view.T for box in self.boxes for face in box_faces(*box)])

    def hidden(self, number: int, point: Array) -> bool:
        """True if a ray toward the viewer meets a box, a cable with its drawn width, or a cable that crosses nearby."""
        if any(ray_meets_box(point, self.toward, *box) for box in self.boxes):
            return True
        for other, line in enumerate(self.lines):
            if other == number or not self.covers[other]:
                continue
            for one, end in pairwise(line):
                distance, along, share = passes(point, self.toward, one, end)
                if along <= HALF + GAP:
                    continue
                if distance < HALF and 0.0 <= share <= 1.0:
                    return True
                if distance < HALF + GAP and self.crosses_near(number, one, end, share):
                    return True
        return False

    def crosses_near(self, number: int, one: Array, end: Array, share: float) -> bool:
        """True if the line crosses the segment in the picture, behind it, near the place."""
        length = np.linalg.norm((end - one) @ self.view[:2].T)
        for begin, stop in zip(self.lines[number][:-1], self.lines[number][1:], strict=True):
            distance, where, other = crossing(begin, stop, one, end, self.toward)
            if distance > HALF + GAP and abs(other - share) * length < ALONG * (HALF + GAP) and 0.0 <= where <= 1.0:
                return True
        return False


def crossing(one: Array, end: Array, two: Array, stop: Array, toward: Array) -> tuple[float, float, float]:
    """Distance of the second segment in front of the first on a common ray, with the place; None without such a ray."""
    share, other, distance = np.linalg.solve(np.column_stack((end - one, two - stop, toward)), two - one)
    return (float(distance) if 0.0 <= other <= 1.0 else -1.0), float(share), float(other)


def distance_to(parts: list[Array], point: Array) -> float:
    """Distance of a point of the picture from the nearest of the parts of lines."""
    least = np.inf
    for part in parts:
        for one, end in pairwise(part):
            step = end - one
            share = np.clip((point - one) @ step / max(step @ step, 1e-30), 0.0, 1.0)
            least = min(least, float(np.linalg.norm(point - one - share * step)))
    return least


@pytest.mark.parametrize("seed", wide([0, 1, *(pytest.param(k, marks=pytest.mark.soak) for k in range(2, 40))]))
def test_omitted_parts_are_hidden_for_a_ray(seed: int) -> None:
    scene = Scene(seed)
    generator = np.random.default_rng(100 + seed)
    found = {True: 0, False: 0}
    for number, (line, parts) in enumerate(zip(scene.lines, scene.parts(), strict=True)):
        for _ in range(40):
            place = generator.uniform(0.0, len(line) - 1.0)
            k = int(place)
            point = line[k] + (place - k) * (line[k + 1] - line[k])
            around = [point + side * NEAR * (line[k + 1] - line[k]) for side in (-1.0, 0.0, 1.0)]
            verdicts = {scene.hidden(number, each) for each in around}
            if len(verdicts) == 2:
                continue  # at the end of a part
            hidden = verdicts.pop()
            shown = distance_to(parts, point @ scene.view.T) < 1e-9
            assert shown != hidden, (seed, number, place)
            found[hidden] += 1
    assert min(found.values()) > 10


def test_three_cables_that_each_pass_before_the_next_are_each_cut_once() -> None:
    """No order of painting whole lines gives this picture."""
    ends = [np.array([np.cos(a), np.sin(a), 0.0]) for a in np.radians([90.0, 210.0, 330.0])]
    lines = []
    for one, other in ((0, 1), (1, 2), (2, 0)):
        middle, step = 0.5 * (ends[one] + ends[other]), 0.8 * (ends[other] - ends[one])
        lines.append(np.stack((middle - step + [0, 0, 0.5], middle + step - [0, 0, 0.5])))
    parts = visible_parts([FlatLine(line, 0.01, 0.02) for line in lines], [])
    assert [len(each) for each in parts] == [2, 2, 2]
    for line, (first, second) in zip(lines, parts, strict=True):
        gap = np.linalg.norm((second[0] - first[-1])[:2])
        assert gap == pytest.approx(2.0 * 0.03 / np.sin(np.radians(60.0)), rel=1e-9)
        assert first[-1][2] < 0.0 < line[0][2]  # at its lower end


def test_lines_that_meet_at_an_anchor_meet_in_the_picture() -> None:
    fan = [np.stack((np.zeros(3), [np.cos(a), np.sin(a), 0.3 * a])) for a in np.linspace(0.0, 2.0, 5)]
    assert [len(parts) for parts in visible_parts([FlatLine(line, 0.005, 0.01) for line in fan], [])] == [1] * 5


def test_visible_edges_of_a_box() -> None:
    """Nine of twelve, from all directions except along an axis."""
    generator = np.random.default_rng(5)
    for _ in range(20):
        turn, size = turned(generator), generator.uniform(0.4, 2.0, 3)
        corners = 0.5 * size * np.array(list(product((-1.0, 1.0), repeat=3))) @ turn.T
        faces = box_faces(np.zeros(3), size, turn)
        edges = [FlatLine(corners[[a, b]], 0.0, 0.0) for a, b in combinations(range(8), 2) if (a ^ b).bit_count() == 1]
        parts = visible_parts(edges, faces)
        lengths = [sum(float(np.linalg.norm(part[-1] - part[0])) for part in each) for each in parts]
        whole = [float(np.linalg.norm(edge.points[1] - edge.points[0])) for edge in edges]
        shares = np.sort(np.divide(lengths, whole))
        np.testing.assert_allclose(shares, [0.0] * 3 + [1.0] * 9, atol=1e-3)


def test_nothing_is_drawn_under_a_label() -> None:
    line = FlatLine(np.array([[-1.0, 0.0, 5.0], [1.0, 0.0, -5.0]]), 0.01, 0.0)
    label = np.array([[-0.1, -0.2], [0.3, -0.2], [0.3, 0.2], [-0.1, 0.2]])
    (parts,) = visible_parts([line], [], [label])
    np.testing.assert_allclose([part[[0, -1], 0] for part in parts], [(-1.0, -0.1), (0.3, 1.0)], atol=1e-12)


def test_nothing_to_draw_and_lines_seen_from_their_ends() -> None:
    assert visible_parts([], []) == []
    upright = FlatLine(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), 0.1, 0.1)
    level = FlatLine(np.array([[-1.0, 0, -1], [1, 0, -1]]), 0.1, 0.0)
    assert [len(parts) for parts in visible_parts([upright, level], [])] == [1, 1]
