"""Functions that CasADi's SX lacks, written with those that it has; to about 1e-15 of their size.

They are smooth where the functions are, so that their derivatives are as good.
"""

from functools import cache
from math import pi, sqrt

import casadi as ca
import mpmath as mp

# P. Godfrey's coefficients for Lanczos's approximation of the gamma function with g = 7.
_LANCZOS_G = 7
_LANCZOS = (
    *(0.99999999999980993, 676.5203681218851, -1259.1392167224028, 771.32342877765313),
    *(-176.61502916214059, 12.507343278686905, -0.13857109526572012, 9.9843695780195716e-6),
    1.5056327351493116e-7,
)


def norm(components: list[ca.SX]) -> ca.SX:
    """Euclidean norm; its derivative at zero is zero."""
    square = ca.SX(0)
    for x in components:
        square = square + x * x
    moving = square > 0
    return ca.if_else(moving, ca.sqrt(ca.if_else(moving, square, 1)), 0)


def cbrt(x: ca.SX) -> ca.SX:
    """Real cube root."""
    return ca.copysign(ca.power(ca.fabs(x), 1.0 / 3.0), x)


def erfc(x: ca.SX) -> ca.SX:
    """1 - erf(x), exact to round-off where that is small, too."""
    near = x < 1
    far = ca.if_else(near, 1, x)
    t = 2 / (2 + far)
    exponent = ca.SX(0)
    for c in _erfc_coefficients():
        exponent = exponent * t + c
    return ca.if_else(near, 1 - ca.erf(x), t * ca.exp(exponent - far * far))


@cache
def _erfc_coefficients() -> tuple[float, ...]:
    """Polynomial in t = 2 / (2 + x), highest power first, for log(erfc(x) / t) + x^2."""

    def exponent(t: mp.mpf) -> mp.mpf:
        x = 2 / mp.mpf(t) - 2
        return mp.log(mp.erfc(x) / t) + x * x

    with mp.workdps(40):
        return tuple(float(c) for c in mp.chebyfit(exponent, [mp.mpf(1) / 20, mp.mpf(2) / 3], 26))


def gamma(x: ca.SX) -> ca.SX:
    """Gamma function."""
    left = x < 0.5
    y = ca.if_else(left, 1 - x, x) - 1
    t = y + _LANCZOS_G + 0.5
    value = sqrt(2 * pi) * ca.exp((y + 0.5) * ca.log(t) - t) * _lanczos_sum(y)
    return ca.if_else(left, pi / (ca.sin(pi * x) * value), value)


def log_gamma(x: ca.SX) -> ca.SX:
    """Logarithm of the gamma function for x > 0."""
    y = x - 1
    t = y + _LANCZOS_G + 0.5
    return (y + 0.5) * ca.log(t) - t + ca.log(sqrt(2 * pi) * _lanczos_sum(y))


def _lanczos_sum(y: ca.SX) -> ca.SX:
    total = ca.SX(_LANCZOS[0])
    for k, c in enumerate(_LANCZOS[1:], start=1):
        total = total + c / (y + k)
    return total
