"""Tableaux: exact values for s = 2, 3, order conditions and symplecticity for every s."""

import mpmath as mp
import numpy as np
import pytest
from signorini.codegen.schemes.tableau import lobatto
from signorini.verify.reference import coefficients


def test_two_and_three_stages_are_the_published_ones() -> None:
    two = lobatto(2).arrays()
    assert two["b"].tolist() == [0.5, 0.5]
    assert two["a"].tolist() == [[0, 0], [0.5, 0.5]]
    assert two["a_hat"].tolist() == [[0.5, 0], [0.5, 0]]
    three = lobatto(3).arrays()
    assert three["b"].tolist() == [1 / 6, 2 / 3, 1 / 6]
    assert three["a"].tolist() == [[0, 0, 0], [5 / 24, 1 / 3, -1 / 24], [1 / 6, 2 / 3, 1 / 6]]
    assert three["a_hat"].tolist() == [[1 / 6, -1 / 6, 0], [1 / 6, 1 / 3, 0], [1 / 6, 5 / 6, 0]]


@pytest.mark.parametrize("s", range(2, 13))
def test_conditions_hold_to_thirty_digits(s: int) -> None:
    t = lobatto(s)
    eps = mp.mpf(10) ** -30
    with mp.workdps(50):
        assert t.c[0] == 0
        assert t.c[-1] == 1
        assert list(t.a[0]) == [0] * s
        assert t.a[-1] == t.b
        for i in range(s):
            assert abs(mp.fsum(t.a[i]) - t.c[i]) < eps
            assert abs(t.a_hat[i][0] - t.b[0]) < eps
            assert t.a_hat[i][-1] == 0
            if s > 2:
                assert abs(mp.fsum(t.a_hat[i]) - t.c[i]) < eps
            for j in range(s):
                pair = t.b[i] * t.a_hat[i][j] + t.b[j] * t.a[j][i] - t.b[i] * t.b[j]
                assert abs(pair) < eps
        for degree in range(2 * s - 2):  # the quadrature is exact up to 2 s - 3
            moment = mp.fsum(b * c**degree for b, c in zip(t.b, t.c, strict=True))
            assert abs(moment - mp.mpf(1) / (degree + 1)) < eps
        moment = mp.fsum(b * c ** (2 * s - 2) for b, c in zip(t.b, t.c, strict=True))
        assert abs(moment - mp.mpf(1) / (2 * s - 1)) > mp.mpf(10) ** -25  # and no further


@pytest.mark.parametrize("s", range(2, 9))
def test_another_construction_agrees(s: int) -> None:
    for mine, other in zip(lobatto(s).arrays().values(), coefficients(s), strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-12)


@pytest.mark.parametrize("s", [1, 0, 13, True, 2.0])
def test_out_of_range(s: object) -> None:
    with pytest.raises(ValueError, match="stages"):
        lobatto(s)  # type: ignore[arg-type]
