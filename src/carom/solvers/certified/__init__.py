"""Certified runs: event-driven simulation in ball arithmetic, in which every digit is proven.

What is named here can be imported without python-flint; `certify` says so where it is missing.
"""

from carom.solvers.certified.as_data import enclosures, from_enclosures
from carom.solvers.certified.certify import MAX_PRECISION_BITS, TIE_BITS, certify
from carom.solvers.certified.result import CertifiedTrace, Degeneracy, Degenerate, Ending, proven_decimal

__all__ = [
    "MAX_PRECISION_BITS",
    "TIE_BITS",
    "CertifiedTrace",
    "Degeneracy",
    "Degenerate",
    "Ending",
    "certify",
    "enclosures",
    "from_enclosures",
    "proven_decimal",
]
