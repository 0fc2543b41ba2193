"""Contact patches: a tiling of the skin of every link.

A link is a capsule; its frame has z along the bone, from its proximal joint (z = 0) to its distal end (z = length).
P patches, `along` bins of z times `around` sectors on each link, then the tip of each fingertip link: a cap, and
with more than two bins along, rings of sectors about it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from haptic_env import readable, validate
from haptic_env.compiled import kernel, part
from haptic_env.link_points import on_skin, within
from haptic_env.moved import renamed

SIDES = ("palmar", "left", "dorsal", "right")

__getattr__ = renamed(__name__, {"Skin": "SkinPoints"})


@dataclass(frozen=True)
class Link:
    """One rigid segment: a capsule from the origin of a body along its z axis.

    Attributes:
        name: of the link.
        body: the MuJoCo body whose frame it has.
        radius: m.
        length: m, of the bone: from the centre of one cap to that of the other.
        tip: whether it ends in a fingertip, which has patches of its own.
    """

    name: str
    body: str
    radius: float
    length: float
    tip: bool = False


@dataclass(frozen=True)
class SkinPoints:
    """Points that cover the surface or fill the inside of the links (M points).

    Attributes:
        points: (M, 3) m, each in its link's frame.
        normals: (M, 3), outward.
        link: (M,) index of the link.
        patch: (M,) index of the patch.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    link: NDArray[np.int64]
    patch: NDArray[np.int64]

    __repr__ = readable.line


class PatchLayout(NamedTuple):
    """Which patches there are, for compiled code: links are cut into C cells, and each cell is of one patch.

    Attributes:
        first: (L,) first patch of each link.
        length: (L,) m, of each bone.
        tip: (L,) whether each link ends in a fingertip.
        along: rows of cells along each bone.
        around: sectors of cells around each bone.
        rings: of cells, of a tip, the cap included.
        cell: (L,) first cell of each link.
        patch: (C,) the patch of each cell; -1 where nothing is felt.
        rows: (P, 2) the first and the last row of cells that each patch has; those of the tip are row `along`.
    """

    first: NDArray[np.int64]
    length: NDArray[np.float64]
    tip: NDArray[np.bool_]
    along: int
    around: int
    rings: int
    cell: NDArray[np.int64]
    patch: NDArray[np.int64]
    rows: NDArray[np.int64]

    def __repr__(self) -> str:
        return readable.line(self)


class Patches:
    """The patches of a hand: which there are, and which one holds a point of the skin.

    Attributes:
        names: (P,).
        link: (P,) index into the hand's links.
        position: (P, 3) m, the skin at each patch's middle, in its link's frame.
        normal: (P, 3), outward there.
        area: (P,) m².
        layout: the same for compiled code.
    """

    def __init__(self, links: tuple[Link, ...], along: int = 2, around: int = 4) -> None:
        """Tile the skin of `links`.

        Args:
            links: (L,) of the hand.
            along: bins along each bone.
            around: sectors around each bone.

        Raises:
            ValueError: for counts out of range.
        """
        self.links = links
        self.along = validate.integer("patches_along", along, 1, 100)
        self.around = validate.integer("patches_around", around, 1, 100)
        self.rings = max(1, self.along // 2)  # of the tip, the cap included
        per_tip = 1 + (self.rings - 1) * self.around
        counts = [self.along * self.around + per_tip * link.tip for link in links]
        self.first = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int64)
        self.count = int(sum(counts))
        self.link = np.repeat(np.arange(len(links)), counts)
        self.layout = self._layout(self.first, np.arange(self.count))
        self.names = tuple(name for link in links for name in self._names_of(link))
        skin = self.surface(spacing=0.001)
        total = np.bincount(skin.patch, minlength=self.count)[:, None]
        mean = np.stack([np.bincount(skin.patch, p, self.count) for p in skin.points.T], axis=1) / total
        # The mean of a curved patch lies beneath the skin, and that of a whole ring on the bone.
        bone = mean[:, 2].clip(0.0, self.layout.length[self.link])[:, None] * [0, 0, 1]
        outward = mean - bone
        outward[np.linalg.norm(outward, axis=1) < 1e-6] = [-1, 0, 0]
        self.normal = outward / np.linalg.norm(outward, axis=1, keepdims=True)
        self.position = bone + np.array([link.radius for link in links])[self.link, None] * self.normal
        weights = self._area_per_point(skin)
        self.area = np.bincount(skin.patch, weights, self.count)

    def __repr__(self) -> str:
        return f"<Patches: {len(self)} on {len(self.links)} links>"

    def __len__(self) -> int:
        return self.count

    @property
    def numb(self) -> NDArray[np.bool_]:
        """(L,) the links that have skin which feels nothing."""
        cells = np.split(self.layout.patch, self.layout.cell[1:])
        return np.array([bool((each < 0).any()) for each in cells])

    def locate(self, link: NDArray[np.int64], points: NDArray[np.float64]) -> NDArray[np.int64]:
        """Find the patches that hold points of the skin.

        Args:
            link: (M,) index of the link on which each point is.
            points: (M, 3) m, each in the frame of its link.

        Returns:
            (M,) indices of patches; -1 where nothing is felt.

        Raises:
            ValueError: for points that are not finite, and links that there are not.
        """
        places = validate.numbers("points", points, 2)
        owner = np.asarray(link, dtype=np.int64)
        if places.shape != (owner.size, 3):
            raise ValueError(f"points must be of shape ({owner.size}, 3), as many as links, got shape {places.shape}")
        if owner.size and not 0 <= owner.min() <= owner.max() < len(self.links):
            raise ValueError(f"link must hold indices in [0, {len(self.links) - 1}], got {validate.shown(link)}")
        patch = np.empty(len(places), dtype=np.int64)
        _locate(owner, places, self.layout, patch)
        return patch

    def surface(self, spacing: float) -> SkinPoints:
        """Spread points over the skin that feels, in no patch none.

        Args:
            spacing: m, at most from one to the next.

        Returns:
            The M points.
        """
        return self._placed([on_skin(link, self.along, self.around, self.rings, spacing) for link in self.links])

    def volume(self, spacing: float, depth: float = 0.0) -> SkinPoints:
        """Fill the links with points on a cubic lattice.

        Args:
            spacing: m, of the lattice.
            depth: m, at least beneath the skin.

        Returns:
            The M points; their normals point from the bone outwards (zero on the bone).
        """
        return self._placed([within(link, spacing, depth) for link in self.links])

    def _placed(self, parts: list[tuple[NDArray[np.float64], NDArray[np.float64]]]) -> SkinPoints:
        """The points and normals of each link as those of the hand."""
        points, normals = (np.concatenate(several) for several in zip(*parts, strict=True))
        link = np.repeat(np.arange(len(parts)), [len(places) for places, _ in parts])
        return SkinPoints(points, normals, link, self.locate(link, points))

    def _layout(self, cell: NDArray[np.int64], patch: NDArray[np.int64]) -> PatchLayout:
        """The layout whose links begin at `cell` (L,), where cells are of `patch` (C,)."""
        within = np.arange(len(patch)) - np.repeat(cell, np.diff(cell, append=len(patch)))
        row = np.minimum(within // self.around, self.along)
        rows = np.empty((self.count, 2), dtype=np.int64)
        rows[:, 0], rows[:, 1] = self.along, 0
        felt = patch >= 0
        np.minimum.at(rows[:, 0], patch[felt], row[felt])
        np.maximum.at(rows[:, 1], patch[felt], row[felt])
        length = np.array([link.length for link in self.links])
        tip = np.array([link.tip for link in self.links])
        shape = self.along, self.around, self.rings
        return PatchLayout(self.first, length, tip, *shape, cell.astype(np.int64), patch.astype(np.int64), rows)

    def _names_of(self, link: Link) -> list[str]:
        sides = SIDES if self.around == len(SIDES) else tuple(f"sector{s}" for s in range(self.around))
        names = [f"{link.name}_{row}_{side}" for row in range(self.along) for side in sides]
        if link.tip:
            names += [f"{link.name}_tip"]
            names += [f"{link.name}_tip{ring}_{side}" for ring in range(1, self.rings) for side in sides]
        return names

    def _area_per_point(self, skin: SkinPoints) -> NDArray[np.float64]:
        """Share (M,) m² of the surface of its cylinder or cap that each point of `skin` stands for."""
        share = np.zeros(len(skin.points))
        for index, link in enumerate(self.links):
            mine = skin.link == index
            cap = mine & (skin.points[:, 2] > link.length)
            side = mine & ~cap
            share[side] = 2 * np.pi * link.radius * link.length / side.sum()
            share[cap] = 2 * np.pi * link.radius**2 / cap.sum()
        return share


@part()
def row_at(layout, link, z):
    """Find the row of patches at a height along a bone.

    Args:
        layout: of the patches.
        link: index of the link.
        z: m, along its bone.

    Returns:
        The row; from `layout.along` on, those of the tip.
    """
    if layout.tip[link] and z > layout.length[link]:
        return layout.along
    return min(max(int(z * (layout.along / layout.length[link])), 0), layout.along - 1)


@part()
def patch_at(layout, link, x, y, z):
    """Find the patch that holds a point of the skin.

    Args:
        layout: of the patches.
        link: index of the link.
        x: m, in the frame of the link.
        y: m.
        z: m.

    Returns:
        The patch; -1 where nothing is felt.
    """
    along, around, rings = layout.along, layout.around, layout.rings
    # Sector 0 is centred on the palmar side (-x).
    turn = np.arctan2(y, x) * (around / (2 * np.pi)) + (1.5 * around + 0.5)
    sector = int(turn) % around
    row = row_at(layout, link, z)
    if row == along:
        polar = np.arctan2(np.hypot(x, y), z - layout.length[link])  # 0 at the pole, pi/2 at the rim
        ring = min(int(polar * (rings / (np.pi / 2))), rings - 1)
        beyond = 0 if ring == 0 else 1 + (ring - 1) * around + sector
        return layout.patch[layout.cell[link] + along * around + beyond]
    return layout.patch[layout.cell[link] + row * around + sector]


@kernel()
def _locate(link, points, layout, patch):
    for m in range(len(points)):
        x, y, z = points[m]
        patch[m] = patch_at(layout, link[m], x, y, z)
