"""Quantiles for intervals and tests, without a statistics package.

With n degrees of freedom the estimated scatter is itself uncertain; 1.96 then holds the truth
in 81 % of the cases for three poses instead of 95 % (docs/reference/calibration.md 2.11).

The distributions are the incomplete gamma and beta functions, by their series and continued
fractions (Abramowitz and Stegun 6.5.29, 6.5.31, 26.5.8); a quantile is found by Newton's steps
inside a bracket, to 1e-8 and better (1e-7 above a million degrees of freedom). Degrees of freedom
need not be whole numbers.
"""

import math
from collections.abc import Callable
from functools import lru_cache

NORMAL_95 = 1.959963984540054
"""97.5 % quantile of the normal distribution."""

_NORMAL_ABOVE = 1e7
"""Number of degrees of freedom above which quantiles equal those of infinitely many, to 1e-7."""

_TINY = 1e-300

_NEGLIGIBLE = 1e-15

_MOST_TERMS = 100_000

_NO_SCATTER = 1e-6
"""Scatter below this share of a shift does not matter."""

_FAR_OFF = 5.0
"""Number of standard deviations of a shift from which only one side of the interval is ever
exceeded."""

_STEPS = 64
"""Number of steps of the sum over the cosine of half a turn; the integrand ends smoothly at both
sides."""


def student_t95(dof: float) -> float:
    """Return the 97.5 % quantile of Student's t: half a 95 % interval.

    Raises:
        ValueError: There is no degree of freedom.
    """
    return student_t(0.975, dof)


@lru_cache(maxsize=1024)
def normal_quantile(p: float) -> float:
    """Return the ``p`` quantile of the normal distribution.

    Raises:
        ValueError: ``p`` is not between 0 and 1.
    """
    _require_probability(p)
    if p < 0.5:
        return -normal_quantile(1 - p)
    if p == 0.5:
        return 0.0
    return _root(
        lambda x: 1 - p - math.erfc(x / math.sqrt(2)) / 2,
        _density,
        start=1.0,
        highest=40.0,
    )


@lru_cache(maxsize=1024)
def student_t(p: float, nu: float) -> float:
    """Return the ``p`` quantile of Student's t with ``nu`` degrees of freedom, may be infinite.

    Raises:
        ValueError: ``nu`` is not positive, or ``p`` not between 0 and 1.
    """
    _require_probability(p)
    _require_dof(nu)
    if nu > _NORMAL_ABOVE:
        return normal_quantile(p)
    if p == 0.5:
        return 0.0
    if p < 0.5:
        return -student_t(1 - p, nu)
    return math.sqrt(f_quantile(2 * p - 1, 1.0, nu))


@lru_cache(maxsize=1024)
def chi_square_quantile(p: float, nu: float) -> float:
    """Return the ``p`` quantile of chi-square with ``nu`` degrees of freedom.

    Raises:
        ValueError: ``nu`` is not positive and finite, or ``p`` not between 0 and 1.
    """
    _require_probability(p)
    _require_dof(nu)
    if nu == 2:
        return -2 * math.log1p(-p)
    if math.isinf(nu):
        raise ValueError("chi-square needs a finite number of degrees of freedom")
    half = nu / 2
    # Wilson and Hilferty's cube: from this start a few steps reach all digits.
    cube = 1 - 2 / (9 * nu) + normal_quantile(p) * math.sqrt(2 / (9 * nu))
    return 2 * _root(
        lambda x: _gamma_below(half, x) - p,
        lambda x: math.exp((half - 1) * math.log(x) - x - math.lgamma(half)),
        start=half * max(cube, 0.01) ** 3,
    )


@lru_cache(maxsize=1024)
def f_quantile(p: float, d1: float, d2: float) -> float:
    """Return the ``p`` quantile of F with ``d1`` and ``d2`` degrees of freedom.

    Raises:
        ValueError: One of them is not positive, or ``p`` not between 0 and 1.
    """
    _require_probability(p)
    _require_dof(d1)
    _require_dof(d2)
    if d2 > _NORMAL_ABOVE:
        return chi_square_quantile(p, d1) / d1
    if d1 == 2:
        return d2 / 2 * math.expm1(-2 / d2 * math.log1p(-p))
    a, b = d1 / 2, d2 / 2
    log_beta = math.lgamma(a) + math.lgamma(b) - math.lgamma(a + b)

    def density(f: float) -> float:
        # d1 f / (d1 f + d2) follows a beta distribution.
        x, y = d1 * f / (d1 * f + d2), d2 / (d1 * f + d2)
        return math.exp(a * math.log(x) + b * math.log(y) - log_beta) / f

    return _root(
        lambda f: _beta_below(a, b, d1 * f / (d1 * f + d2), d2 / (d1 * f + d2)) - p,
        density,
        start=1.0,
    )


def f_exceeded(f: float, d1: float, d2: float) -> float:
    """Return how likely a value of F with ``d1`` and ``d2`` degrees of freedom is above ``f``.

    Args:
        f: The value; the square of a t counts with ``d1`` 1.
        d1: Degrees of freedom of its numerator.
        d2: Those of its denominator.

    Example:
        >>> from robolink.calibration import f_exceeded, student_t
        >>> round(f_exceeded(student_t(0.975, 29) ** 2, 1.0, 29.0), 9)
        0.05

    Raises:
        ValueError: One of them is not positive.
    """
    _require_dof(d1)
    _require_dof(d2)
    return _beta_below(d2 / 2, d1 / 2, d2 / (d1 * f + d2), d1 * f / (d1 * f + d2))


def shifted_half95(shift: float, sigma: float) -> float:
    """Return half the interval about a value that holds the truth in 95 % beside a fixed shift.

    Args:
        shift: What the value is off by, always the same.
        sigma: Standard deviation of what comes on top of it, of a normal distribution.

    Example:
        >>> from robolink.calibration import shifted_half95
        >>> round(shifted_half95(0.0, 1.0), 2), round(shifted_half95(3.0, 1.0), 3)
        (1.96, 4.645)
    """
    if sigma <= abs(shift) * _NO_SCATTER:
        return abs(shift)
    off = abs(shift) / sigma
    if off > _FAR_OFF:
        return abs(shift) + sigma * normal_quantile(0.95)
    return sigma * _root(
        lambda x: _normal(x - off) - _normal(-x - off) - 0.95,
        lambda x: _density(x - off) + _density(x + off),
        start=max(NORMAL_95, off + 1.645),
    )


def shifted_region95(
    shift: tuple[float, float], sigmas: tuple[float, float], *, least: float = 0.0
) -> float:
    """Return the radius about a point that holds the truth in 95 % beside a fixed shift.

    Args:
        shift: What the point is off by, along the principal axes of the scatter.
        sigmas: Standard deviations along these axes, of a normal distribution.
        least: A radius that is taken anyway, if the truth does not need more.

    Example:
        >>> from robolink.calibration import shifted_region95
        >>> round(shifted_region95((0.0, 0.0), (1.0, 1.0)), 3)  # as chi-squared has it
        2.448
        >>> round(shifted_region95((1.6, 0.0), (1.0, 1.0)), 2)
        3.46
    """
    (along, across), (wide, narrow) = shift, sigmas
    if wide < narrow:
        along, across, wide, narrow = across, along, narrow, wide
    off = math.hypot(along, across)
    if wide <= off * _NO_SCATTER:
        return max(off, least)
    narrow = max(narrow, wide * _NO_SCATTER)

    def missed(radius: float) -> float:
        """Return how much of what is missed is too much; the scatter is summed up along."""
        low, high = max(-radius, along - 8 * wide), min(radius, along + 8 * wide)
        middle, half, total = (low + high) / 2, (high - low) / 2, 0.0
        for cosine, sine in _midpoints():
            x = middle + half * sine
            reach = math.sqrt(max(radius * radius - x * x, 0.0))
            inside = _normal((reach - across) / narrow) - _normal((-reach - across) / narrow)
            total += cosine * _density((x - along) / wide) * inside
        return 0.95 - total * half * math.pi / _STEPS / wide

    low, high = max(off, least), off + 2.5 * wide
    if low >= high or missed(low) <= 0:
        return low
    while high - low > 1e-4 * high:
        between = (low + high) / 2
        low, high = (between, high) if missed(between) > 0 else (low, between)
    return high


@lru_cache(maxsize=1)
def _midpoints() -> tuple[tuple[float, float], ...]:
    """Return cosine and sine of the middles of equal steps over half a turn."""
    turns = (math.pi * ((index + 0.5) / _STEPS - 0.5) for index in range(_STEPS))
    return tuple((math.cos(turn), math.sin(turn)) for turn in turns)


@lru_cache(maxsize=64)
def studentized_range_0999(count: int) -> float:
    """Return the range that ``count`` normal values of standard deviation 1 stay in, in 99.9 %.

    The distribution of the range is count times the integral of the density at the lowest value,
    times the chance that all others lie between it and the range above it.

    Raises:
        ValueError: There are fewer than two values.
    """
    if count < 2:
        raise ValueError(f"no range exists of {count} values")

    steps, low, high = 400, -9.0, 9.0
    lowest = []
    for index in range(steps + 1):
        z = low + (high - low) * index / steps
        weight = 1 if index in (0, steps) else 4 if index % 2 else 2
        lowest.append((z, _normal(z), weight * _density(z)))

    def inside(width: float) -> float:
        total = sum(
            weighed * (_normal(z + width) - below) ** (count - 1) for z, below, weighed in lowest
        )
        return count * total * (high - low) / steps / 3

    least, most = 1.0, 20.0
    while most - least > 1e-7:
        middle = (least + most) / 2
        least, most = (middle, most) if inside(middle) < 0.999 else (least, middle)
    return (least + most) / 2


def _density(x: float) -> float:
    return math.exp(-x * x / 2) / math.sqrt(2 * math.pi)


def _normal(x: float) -> float:
    return math.erfc(-x / math.sqrt(2)) / 2


def _require_probability(p: float) -> None:
    if not 0 < p < 1:
        raise ValueError(f"a probability lies between 0 and 1, not at {p}")


def _require_dof(nu: float) -> None:
    if not nu > 0:
        raise ValueError(f"no interval exists with {nu} degrees of freedom")


def _root(
    short: Callable[[float], float],
    slope: Callable[[float], float],
    *,
    start: float,
    highest: float = math.inf,
) -> float:
    """Return where ``short``, which rises from below 0, becomes 0; above 0 and below ``highest``.

    A step of Newton's that leaves the bracket is replaced by halving, or by going four times as
    far while nothing bounds it.
    """
    low, high, x = 0.0, highest, start
    for _ in range(300):
        missing = short(x)
        low, high = (x, high) if missing < 0 else (low, x)
        rising = slope(x)
        step = missing / rising if rising > _TINY else math.inf
        ahead = x - step
        if abs(step) <= 1e-14 * x:
            return ahead
        if not low < ahead < high:
            middle = x / 16 if low == 0.0 else (low + high) / 2
            ahead = 4 * x if math.isinf(high) else middle
        if abs(ahead - x) <= 1e-15 * x:
            return ahead
        x = ahead
    return x


def _gamma_below(a: float, x: float) -> float:
    """Return the regularised incomplete gamma function P(a, x)."""
    front = math.exp(a * math.log(x) - x - math.lgamma(a))
    if x < a + 1:
        term = total = 1 / a
        for k in range(1, _MOST_TERMS):
            term *= x / (a + k)
            total += term
            if term < total * _NEGLIGIBLE:
                break
        return total * front
    b = x + 1 - a
    c, d = 1 / _TINY, 1 / b
    fraction = d
    for k in range(1, _MOST_TERMS):
        b += 2
        d = 1 / _kept_from_zero(b - k * (k - a) * d)
        c = _kept_from_zero(b - k * (k - a) / c)
        fraction *= c * d
        if abs(c * d - 1) < _NEGLIGIBLE:
            break
    return 1 - fraction * front


def _beta_below(a: float, b: float, x: float, y: float) -> float:
    """Return the regularised incomplete beta function at ``x``; ``y`` is 1 - x in full digits."""
    if x > (a + 1) / (a + b + 2):
        return 1 - _beta_below(b, a, y, x)
    if x <= 0:
        return 0.0
    log_front = a * math.log(x) + b * math.log(y)
    log_front -= math.lgamma(a) + math.lgamma(b) - math.lgamma(a + b)
    c, d = 1.0, 1 / _kept_from_zero(1 - (a + b) * x / (a + 1))
    fraction = d
    for k in range(1, _MOST_TERMS):
        even = k * (b - k) * x / ((a + 2 * k - 1) * (a + 2 * k))
        d = 1 / _kept_from_zero(1 + even * d)
        c = _kept_from_zero(1 + even / c)
        fraction *= c * d
        odd = -(a + k) * (a + b + k) * x / ((a + 2 * k) * (a + 2 * k + 1))
        d = 1 / _kept_from_zero(1 + odd * d)
        c = _kept_from_zero(1 + odd / c)
        fraction *= c * d
        if abs(c * d - 1) < _NEGLIGIBLE:
            break
    return math.exp(log_front) * fraction / a


def _kept_from_zero(value: float) -> float:
    return value if abs(value) > _TINY else _TINY
