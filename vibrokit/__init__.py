"""Stochastic stability of vibro-impact oscillators.

The public names are listed in __init__.pyi and loaded on first use, so that importing vibrokit is fast.
"""

from typing import Any

import lazy_loader

__version__ = "0.1.0"

_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'vibrokit' has no attribute {name!r}; it offers {', '.join(__all__)}.")
    return _load(name)
