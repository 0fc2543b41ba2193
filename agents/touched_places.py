"""What a finger remembers of where it has touched, so that it goes elsewhere: seconds, on a grid of its strokes.

Where it is, it takes from what it has commanded lately, for it feels contacts alone: a finger follows its torques late.

Shapes: F fingers, B places along each of three strokes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
PLACES = 11  # B
CENTRES = np.linspace(-1.0, 1.0, PLACES)  # of them, as fractions of a stroke


class TouchedPlaces(NamedTuple):
    """Where each finger is, and where it has touched.

    Attributes:
        where: (3, F) fractions of its strokes, in [-1, 1].
        touched: (F, B, B, B) s.
    """

    where: Floats
    touched: Floats

    def moved(self, strokes: Floats, share: float) -> TouchedPlaces:
        """Follow what was commanded.

        Args:
            strokes: (3, F), of which nothing is beyond [-1, 1].
            share: of the way there that a finger has gone since.

        Returns:
            Where it is then.
        """
        return self._replace(where=self.where + share * (np.clip(strokes, -1.0, 1.0) - self.where))

    def touching(self, seconds: Floats) -> TouchedPlaces:
        """Take in what touches.

        Args:
            seconds: (F,), for how long each finger touches where it is; 0: it does not.

        Returns:
            With them.
        """
        touched = self.touched.copy()
        index = np.rint(0.5 * (self.where + 1.0) * (PLACES - 1)).astype(np.int64)
        touched[np.arange(len(seconds)), index[0], index[1], index[2]] += seconds
        return self._replace(touched=touched)

    def known(self, width: float, enough: float) -> tuple[Floats, Floats]:
        """Tell how well each finger knows where it is, and which way leads from what it knows.

        Args:
            width: of what counts as the same place, SD.
            enough: s of touch by which a place is half known.

        Returns:
            Share (F,) in [0, 1) to which it is known, and that share's (3, F) mean way from the places that it knows,
            in widths.
        """
        way = (self.where[..., None] - CENTRES) / width  # (3, F, B)
        near = np.exp(-0.5 * way**2)
        both = np.stack([near, near * way], axis=3)  # (3, F, B, 2): how near, and that times the way
        first, second, third = both
        sums = self.touched @ third[:, None]  # (F, B, B, 2)
        sums = np.einsum("fabk,fbl->falk", sums, second)
        sums = np.einsum("falk,fam->fmlk", sums, first)
        total, away = sums[:, 0, 0, 0], np.stack([sums[:, 1, 0, 0], sums[:, 0, 1, 0], sums[:, 0, 0, 1]])
        return total / (enough + total), away / (enough + total)
