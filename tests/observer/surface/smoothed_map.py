"""The other way to a surface, to compare with: the map alone, its log-odds smoothed, about the same expected sphere.

The surface is where solid and free are as probable; the SD is that of the logistic distribution whose slope log-odds
have there. What is not known says nothing, so that the sphere decides.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.optimize import least_squares
from scipy.special import logit

from haptic_env.arrays import Array
from haptic_env.grid import Grid
from haptic_env.shapes import triangles
from observer.maps.contact_model import ContactModel
from observer.surface import Surface
from observer.surface.mesh import EMPTY

BLUR = 1.5  # voxels
SURE = 4.0  # log-odds, beyond which a voxel says no more
RADIUS, RADIUS_STD, AWAY_STD = 0.025, 0.006, 0.020  # m, of the sphere
SHELL = 0.004  # m, over which the sphere's log-odds change by one


def smoothed(occupancy: Array, grid: Grid) -> Surface:
    """The surface of a map (X, Y, Z)."""
    places = grid.centres()[occupancy > 0.5]
    if len(places) < 4:
        return EMPTY

    def misfit(told: Array) -> Array:
        beyond = (np.linalg.norm(places - told[:3], axis=1) - told[3]) / SHELL / np.sqrt(1 + len(places) / 20)
        return np.concatenate([beyond, (told[:3] - grid.centre) / AWAY_STD, [(told[3] - RADIUS) / RADIUS_STD]])

    *centre, radius = least_squares(misfit, np.append(places.mean(axis=0), RADIUS)).x
    told = np.clip(logit(np.clip(occupancy, 1e-3, 1 - 1e-3)) - logit(ContactModel.prior), -SURE, SURE)
    told[occupancy == 0.5] = 0.0
    odds = gaussian_filter(told, BLUR) + (radius - np.linalg.norm(grid.centres() - centre, axis=-1)) / SHELL
    for axis in range(3):
        np.moveaxis(odds, axis, 0)[[0, -1]] = -1.0  # closed at the rim
    found = triangles.largest_part(triangles.marched(-odds, grid))
    if found is None:
        return EMPTY
    vertices, faces = found
    where = (vertices - grid.origin).T / grid.resolution - 0.5
    slope = [map_coordinates(each, where, order=1, mode="nearest") for each in np.gradient(odds, grid.resolution)]
    std = np.pi / np.sqrt(3.0) / np.maximum(np.linalg.norm(slope, axis=0), 1e-9)
    return Surface(vertices, faces, std)
