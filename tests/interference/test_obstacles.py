import numpy as np

import sagline as sl
from tests.interference.scenes import at_rest


def test_beams_are_the_edges_of_the_frame() -> None:
    robot = sl.load_robot("article-suspended")
    beams = sl.frame_beams(robot, radius=0.04)
    assert robot.frame_size is not None
    lengths = sorted(float(np.linalg.norm(beam.end - beam.start)) for beam in beams)
    assert np.allclose(lengths, np.repeat(np.sort(robot.frame_size), 4))
    assert len({beam.name for beam in beams}) == 12
    found = sl.clearance(at_rest("article-suspended"), beams, from_anchor=1.0)
    frame = [value for pair, value in zip(found.pairs, found.pair_distance, strict=True) if "beam" in pair[1]]
    assert len(frame) == 8 * 12
    assert min(frame) > 0.0
