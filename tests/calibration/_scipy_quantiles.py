"""Quantiles from scipy's special functions, which ``scipy.stats`` itself uses.

Importing ``scipy.stats`` costs each process of the suite 0.6 s more.
"""

from scipy.special import fdtri, gammaincinv, ndtri, stdtrit


def normal(p: float) -> float:
    """Return the quantile of the normal distribution."""
    return float(ndtri(p))


def student(p: float, nu: float) -> float:
    """Return the quantile of Student's t."""
    return float(stdtrit(nu, p))


def chi_square(p: float, nu: float) -> float:
    """Return the quantile of chi-square."""
    return float(2 * gammaincinv(nu / 2, p))


def fisher(p: float, nu1: float, nu2: float) -> float:
    """Return the quantile of F."""
    return float(fdtri(nu1, nu2, p))
