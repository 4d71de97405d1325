import re

import numpy as np
import pytest

from sagline import InvalidValueError
from sagline.files.quantity import pose_of_text
from tests.refusal import refused


def test_meters_and_degrees() -> None:
    pose = pose_of_text(" 1, -0.5 ,1.5e0")
    assert pose.position.tolist() == [1.0, -0.5, 1.5]
    assert pose.quaternion.tolist() == [0.0, 0.0, 0.0, 1.0]
    np.testing.assert_allclose(pose_of_text("1,0,010,90,0,0").matrix, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    assert pose_of_text("1,0,010").position[2] == 10.0


@pytest.mark.parametrize(
    "text",
    ["", "1,2", "1,2,3,4", "1,2,3,4,5,6,7", "1,2,x", "1_0,2,3", "1:30,2,3", "0x10,2,3", "٣,2,3", "nan,2,3", "inf,2,3",
     "1e308,2,3", "1,2,3,1e400,0,0", "1.1e6,0,0", "0,0,-2e6", "0,0,0,2e6,0,0", "1,2,",
     "1;2;3", "1 2 3", "1,2,3 m", "𝟙,2,3", "1,2,3\x1b[2J", "1," * 100_000],
)  # fmt: skip
def test_invalid_poses(text: str) -> None:
    with refused("--pose", kind=InvalidValueError) as caught:
        pose_of_text(text)
    assert re.match("(three|decimal)", caught.value.allowed)
    assert len(str(caught.value)) < 300
    assert "\x1b" not in str(caught.value)
