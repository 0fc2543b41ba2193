"""Patches that are told one by one: taxels, each with a place on the skin, where it faces and how far it feels.

The skin of a link is cut into small cells. Each is of the taxel nearest to it, if that faces the same way and reaches
as far; the others feel nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env.patches import Link, Patches, SkinPoints

ROWS, SECTORS = 32, 32  # of the cells of a link
FACING = 0.5  # cosine between where a taxel faces and where its skin does, at least
OFF_SKIN = 0.01  # m: as far may a taxel be from the capsules that stand for its link


class Taxel(NamedTuple):
    """One place that feels.

    Attributes:
        name: of the patch.
        link: index of the link.
        position: (3,) m, in the frame of the link.
        normal: (3,) of unit length, outward.
        radius: m, how far from its place it feels.
    """

    name: str
    link: int
    position: NDArray[np.float64]
    normal: NDArray[np.float64]
    radius: float


class TaxelPatches(Patches):
    """The patches of a hand as a list of taxels: what lies between them, or faces another way, feels nothing."""

    def __init__(self, links: tuple[Link, ...], taxels: Sequence[Taxel]) -> None:
        """Give each taxel its cells of the skin.

        Args:
            links: (L,) of the hand.
            taxels: (P,) in any order; as patches they are in that of their links.

        Raises:
            ValueError: for a taxel that lies off the skin, or where another does.
        """
        cells = Patches(links, ROWS, SECTORS)
        inside, faces, of = cells.position, cells.normal, cells.link  # a point of each cell
        told = sorted(taxels, key=lambda each: each.link)
        self.links, self.along, self.around, self.rings = links, cells.along, cells.around, cells.rings
        self.count = len(told)
        self.link = np.array([each.link for each in told], dtype=np.int64)
        self.first = np.searchsorted(self.link, np.arange(len(links))).astype(np.int64)
        self.names = tuple(each.name for each in told)
        patch, nearest = np.full(len(cells), -1), np.full(len(cells), np.inf)
        home = np.empty(len(told), dtype=np.int64)
        for index, each in enumerate(told):
            mine = np.flatnonzero((of == each.link) & (faces @ each.normal >= FACING))
            if not mine.size:
                raise ValueError(f"taxel {each.name!r} faces where link {links[each.link].name!r} has no skin")
            gap = np.linalg.norm(inside[mine] - each.position, axis=1)
            home[index], off = mine[gap.argmin()], float(gap.min())
            if off > OFF_SKIN:
                raise ValueError(
                    f"taxel {each.name!r} lies {1e3 * off:.0f} mm off the skin of link {links[each.link].name!r} that "
                    f"faces as it does; at most {1e3 * OFF_SKIN:.0f} mm are valid, and normals point outward"
                )
            from_home = np.linalg.norm(inside[mine] - inside[home[index]], axis=1)
            taken = mine[(from_home <= each.radius) & (from_home < nearest[mine])]
            patch[taken], nearest[taken] = index, np.linalg.norm(inside[taken] - inside[home[index]], axis=1)
        lost = np.flatnonzero(~np.isin(np.arange(len(told)), patch))
        if lost.size:
            other = self.names[next(k for k in range(len(told)) if k != lost[0] and home[k] == home[lost[0]])]
            raise ValueError(f"taxels {other!r} and {self.names[lost[0]]!r} lie at the same place of the skin")
        self.layout = self._layout(cells.first, patch)
        self.position, self.normal = inside[home], faces[home]
        self.area = np.bincount(patch[patch >= 0], cells.area[patch >= 0], self.count)

    def surface(self, spacing: float) -> SkinPoints:
        """Spread points over the skin that feels, in no taxel none.

        Args:
            spacing: m, at most from one to the next.

        Returns:
            The M points.
        """
        skin = Patches(self.links, 1, 1).surface(spacing)
        patch = self.locate(skin.link, skin.points)
        felt = patch >= 0
        left = np.flatnonzero(~np.isin(np.arange(self.count), patch))  # taxels smaller than the spacing
        owner = np.concatenate([skin.link[felt], self.link[left]])
        order = np.argsort(owner, kind="stable")
        return SkinPoints(
            np.concatenate([skin.points[felt], self.position[left]])[order],
            np.concatenate([skin.normals[felt], self.normal[left]])[order],
            owner[order],
            np.concatenate([patch[felt], left])[order],
        )
