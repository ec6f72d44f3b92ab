"""The hostile adapters of the runs' tests, for the stress tests, too."""

from __future__ import annotations
