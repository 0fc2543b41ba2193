"""A map at the true pose and without noise is a map of the object."""

from __future__ import annotations

import numpy as np
import pytest

from haptic_env import shapes
from observer import HapticSLAM, TruePose
from observer.maps.contact_model import ContactModel

STEPS = 1000  # 20 s


@pytest.fixture(scope="module", params=shapes.SHAPES)
def told(request: pytest.FixtureRequest, explore):
    """The occupancy (X, Y, Z) of a shape, and the signed distance of every voxel's centre in voxels."""
    trial = explore(request.param, STEPS, sigma_deg=0.0, motor_noise=0.0)
    slam = TruePose(trial.hand)
    occupancy = trial.beliefs(slam, truth=True)[-1].occupancy
    return occupancy, trial.solid.signed_distance(slam.grid.centres()) / slam.grid.resolution


def test_what_was_swept_lies_outside_the_object(told):
    occupancy, distance = told
    swept = occupancy < 0.5 * ContactModel().prior
    assert swept.sum() > 1000
    assert (distance[swept] < -0.5).mean() < 0.001


def test_what_is_near_the_hand_is_seldom_occupied(told):
    """Where the hand came near but not to, the prior is told; it has to be about right."""
    occupancy, distance = told
    near = np.isclose(occupancy, ContactModel().prior)
    assert near.sum() > 300
    assert 0.3 * ContactModel().prior < (distance[near] < 0).mean() < 4 * ContactModel().prior


def test_what_is_occupied_lies_at_the_surface(told):
    occupancy, distance = told
    occupied = np.abs(distance[occupancy > 0.5])
    assert len(occupied) > 30
    assert (occupied <= 1).mean() >= 0.84
    assert (occupied <= 2).mean() >= 0.9


def test_without_noise_the_observer_maps_as_the_true_pose_does(explore):
    trial = explore("cylinder", 500, sigma_deg=0.0, motor_noise=0.0)
    slam = HapticSLAM(trial.hand, 0.0, motor_noise=0.0)
    occupancy = trial.beliefs(slam)[-1].occupancy
    ceiling = trial.beliefs(TruePose(trial.hand), truth=True)[-1].occupancy
    assert (ceiling > 0.5).sum() > 10
    assert (np.abs(occupancy - ceiling) > 0.01)[ceiling != 0.5].mean() < 0.01
