"""The surface of what was touched: a closed mesh that says of each vertex how surely it is known.

`Belief.surface` is what uses it.
"""

from observer.surface.mesh import Surface
from observer.surface.reconstruction import reconstruct
from observer.surface.touches import TouchLog

__all__ = ["Surface", "TouchLog", "reconstruct"]
