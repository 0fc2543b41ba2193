"""Contact patches: a tiling of the skin of every link.

A link is a capsule; its frame has z along the bone, from its proximal joint (z = 0) to its distal end (z = length).
P patches, `along` bins of z times `around` sectors on each link, then the tip of each fingertip link: a cap, and
with more than two bins along, rings of sectors about it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from haptic_env import validate
from haptic_env.compiled import kernel, part
from haptic_env.moved import renamed

SIDES = ("palmar", "left", "dorsal", "right")

__getattr__ = renamed(__name__, {"Skin": "SkinPoints"})


@dataclass(frozen=True)
class Link:
    """One rigid segment: a capsule of `radius` (m) from the origin of `body` along its z axis for `length` (m)."""

    name: str
    body: str
    radius: float
    length: float
    tip: bool = False


@dataclass(frozen=True)
class SkinPoints:
    """Points that cover the surface or fill the inside of the links (M points).

    `points` (M, 3) m in their link's frame; `normals` (M, 3) outward; `link` (M,) and `patch` (M,) indices.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    link: NDArray[np.int64]
    patch: NDArray[np.int64]


class Patches:
    """The patches of a hand: which there are, and which one holds a point of the skin.

    `names` (P,), `link` (P,) index into the hand's links, `position` (P, 3) m and outward `normal` (P, 3) of the skin
    at each patch's middle, in its link's frame, `area` (P,) m².
    """

    def __init__(self, links: tuple[Link, ...], along: int = 2, around: int = 4) -> None:
        self.links = links
        self.along = validate.integer("patches_along", along, 1, 100)
        self.around = validate.integer("patches_around", around, 1, 100)
        self.rings = max(1, self.along // 2)  # of the tip, the cap included
        per_tip = 1 + (self.rings - 1) * self.around
        counts = [self.along * self.around + per_tip * link.tip for link in links]
        self.first = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int64)
        self.count = int(sum(counts))
        self.link = np.repeat(np.arange(len(links)), counts)
        self._length = np.array([link.length for link in links])
        tip = np.array([link.tip for link in links])
        self.layout = self.first, self._length, tip, self.along, self.around, self.rings  # for `patch_at`
        self.names = tuple(name for link in links for name in self._names_of(link))
        skin = self.surface(spacing=0.001)
        total = np.bincount(skin.patch, minlength=self.count)[:, None]
        mean = np.stack([np.bincount(skin.patch, p, self.count) for p in skin.points.T], axis=1) / total
        # The mean of a curved patch lies beneath the skin, and that of a whole ring on the bone.
        bone = mean[:, 2].clip(0.0, self._length[self.link])[:, None] * [0, 0, 1]
        outward = mean - bone
        outward[np.linalg.norm(outward, axis=1) < 1e-6] = [-1, 0, 0]
        self.normal = outward / np.linalg.norm(outward, axis=1, keepdims=True)
        self.position = bone + np.array([link.radius for link in links])[self.link, None] * self.normal
        weights = self._area_per_point(skin)
        self.area = np.bincount(skin.patch, weights, self.count)

    def __len__(self) -> int:
        return self.count

    def locate(self, link: NDArray[np.int64], points: NDArray[np.float64]) -> NDArray[np.int64]:
        """Patch indices (M,) of skin `points` (M, 3) m, each in the frame of its `link` (M,).

        Raises `ValueError` for points that are not finite, and links that there are not."""
        places = validate.numbers("points", points, 2)
        owner = np.asarray(link, dtype=np.int64)
        if places.shape != (owner.size, 3):
            raise ValueError(f"points must be of shape ({owner.size}, 3), as many as links, got shape {places.shape}")
        if owner.size and not 0 <= owner.min() <= owner.max() < len(self.links):
            raise ValueError(f"link must hold indices in [0, {len(self.links) - 1}], got {validate.shown(link)}")
        patch = np.empty(len(places), dtype=np.int64)
        _locate(owner, places, *self.layout, patch)
        return patch

    def surface(self, spacing: float) -> SkinPoints:
        """Points on the skin, at most `spacing` (m) apart and in no patch none."""
        points: list[NDArray[np.float64]] = []
        normals: list[NDArray[np.float64]] = []
        owner: list[NDArray[np.int64]] = []
        for index, link in enumerate(self.links):
            rows = max(self.along, int(np.ceil(link.length / spacing)))
            rows = int(np.ceil(rows / self.along)) * self.along
            sectors = max(self.around, int(np.ceil(2 * np.pi * link.radius / spacing)))
            sectors = int(np.ceil(sectors / self.around)) * self.around
            angle = (np.arange(sectors) + 0.5) / sectors * 2 * np.pi + np.pi - np.pi / self.around
            ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(sectors)], axis=1)
            height = (np.arange(rows) + 0.5) / rows * link.length
            side = np.tile(ring, (rows, 1))
            points.append(link.radius * side + np.repeat(height, sectors)[:, None] * [0, 0, 1])
            normals.append(side)
            bands = max(self.rings, int(np.ceil(0.5 * np.pi * link.radius / spacing)))
            bands = int(np.ceil(bands / self.rings)) * self.rings
            for band in range(bands):
                polar = (band + 0.5) / bands * np.pi / 2
                number = max(self.around if link.tip and self.rings > 1 else 1, int(np.ceil(sectors * np.sin(polar))))
                turn = (np.arange(number) + 0.5) / number * 2 * np.pi + np.pi - np.pi / self.around
                cap = np.stack([np.cos(turn), np.sin(turn), np.zeros(number)], axis=1) * np.sin(polar)
                cap[:, 2] = np.cos(polar)
                points.append(link.radius * cap + [0, 0, link.length])
                normals.append(cap)
            owner.append(np.full(sum(map(len, points)) - sum(map(len, owner)), index))
        placed, link_of = np.concatenate(points), np.concatenate(owner)
        return SkinPoints(placed, np.concatenate(normals), link_of, self.locate(link_of, placed))

    def volume(self, spacing: float, depth: float = 0.0) -> SkinPoints:
        """Points inside the links on a cubic lattice of `spacing` (m), at least `depth` (m) beneath the skin.

        `normals` point from the bone outwards (zero on the bone).
        """
        points, normals, owner = [], [], []
        for index, link in enumerate(self.links):
            reach = np.arange(0.0, link.radius, spacing)
            across = np.concatenate([-reach[:0:-1], reach])
            rise = np.arange(-link.radius, link.length + link.radius, spacing) + 0.5 * spacing
            lattice = np.stack(np.meshgrid(across, across, rise, indexing="ij"), axis=-1).reshape(-1, 3)
            bone = np.clip(lattice[:, 2], 0.0, link.length)[:, None] * [0, 0, 1]
            radial = lattice - bone
            distance = np.linalg.norm(radial, axis=1)
            inside = distance < link.radius - depth
            points.append(lattice[inside])
            normals.append(radial[inside] / np.maximum(distance[inside, None], 1e-12))
            owner.append(np.full(int(inside.sum()), index))
        placed, link_of = np.concatenate(points), np.concatenate(owner)
        return SkinPoints(placed, np.concatenate(normals), link_of, self.locate(link_of, placed))

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
def row_at(length, tip, along, link, z):
    """The row of patches of `link` at height `z` m along its bone; `along` for those of its tip."""
    if tip[link] and z > length[link]:
        return along
    return min(max(int(z * (along / length[link])), 0), along - 1)


@part()
def patch_at(first, length, tip, along, around, rings, link, x, y, z):
    """The patch of `link` that holds a skin point (m, in its frame), by the `Patches.layout` of the hand."""
    # Sector 0 is centred on the palmar side (-x).
    turn = np.arctan2(y, x) * (around / (2 * np.pi)) + (1.5 * around + 0.5)
    sector = int(turn) % around
    row = row_at(length, tip, along, link, z)
    if row == along:
        polar = np.arctan2(np.hypot(x, y), z - length[link])  # 0 at the pole, pi/2 at the rim
        ring = min(int(polar * (rings / (np.pi / 2))), rings - 1)
        beyond = 0 if ring == 0 else 1 + (ring - 1) * around + sector
        return first[link] + along * around + beyond
    return first[link] + row * around + sector


@kernel()
def _locate(link, points, first, length, tip, along, around, rings, patch):
    for m in range(len(points)):
        x, y, z = points[m]
        patch[m] = patch_at(first, length, tip, along, around, rings, link[m], x, y, z)
