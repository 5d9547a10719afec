"""``dqwatch fleet``: motors of a fleet compared with each other.

The module is the function: ``dqwatch.fleet(logs, out)``.

See :func:`dqwatch.fleet.api.fleet`.
"""

from __future__ import annotations

import sys
import types
from typing import Any

from .main import main

__all__ = ["main"]


class _Callable(types.ModuleType):
    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """As :func:`dqwatch.fleet.api.fleet`."""
        from .api import fleet

        return fleet(*arguments, **named)


sys.modules[__name__].__class__ = _Callable
