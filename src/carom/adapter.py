"""Old import path of `carom.engines.api`, for adapters written for earlier versions."""

from carom.engines.api import *  # noqa: F403 - every name of the new module
from carom.engines.api import __all__ as __all__  # noqa: PLC0414 - for type checkers
