import numpy as np
import pytest

from sagline import article_path


def test_the_planar_path_of_the_comparison() -> None:
    path = article_path()
    assert len(path) == 6001
    assert path.duration == 60.0
    np.testing.assert_array_equal(path.pose.position[:, 2], 1.5)
    np.testing.assert_array_equal(path.pose.quaternion, np.tile([0.0, 0.0, 0.0, 1.0], (6001, 1)))
    np.testing.assert_array_equal(path.twist[:, 2:], 0.0)
    corners = path.pose.position[[0, 900, 2000, 3000, 4100, 5100, 6000], :2]
    np.testing.assert_allclose(
        corners, [(0, 0), (5, 3.5), (-5, 3.5), (-5, -3.5), (5, -3.5), (5, 3.5), (0, 0)], atol=1e-12
    )
    assert np.linalg.norm(path.twist[:, :3], axis=1).max() == pytest.approx(1.705, abs=1e-3)  # 15/8 of 10 m in 11 s
    assert np.linalg.norm(path.twist_rate[:, :3], axis=1).max() == pytest.approx(0.477, abs=1e-3)


def test_the_rate_is_an_argument() -> None:
    assert len(article_path(rate=10.0)) == 601
