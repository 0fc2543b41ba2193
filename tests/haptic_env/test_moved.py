"""What was moved is found under its old name, with a warning that says where it is."""

from __future__ import annotations

import importlib
import sys
import warnings

import pytest

import agents  # noqa: F401 - its modules were moved too
import observer
from haptic_env.moved import _FINDER

NAMES = {  # of each module, as version 0.1 had them
    "agents.reach": "Strokes LEAST",
    "agents.smooth_chance": "OrnsteinUhlenbeck",
    "haptic_env.skeleton": "hand_of Bone",
    "observer.belief_observation": "ENTRIES BeliefObservation CLOCKS_HZ",
    "observer.capsules": "QUANTUM Evidence Stance Reach body_of lattice_of stand",
    "observer.contact_model": "ContactModel",
    "observer.decide_when_sure": "DecideWhenSure",
    "observer.decision_reward": "DecisionReward",
    "observer.delta_pose": "DeltaPose",
    "observer.forward_model": "ForwardModel",
    "observer.hindsight": "occupancy Moment",
    "observer.information_gain_reward": "InformationGainReward",
    "observer.kernels": "advance",
    "observer.kinematic_pose": "KinematicPose",
    "observer.known_kernels": "take_in nearest",
    "observer.known_solids": "KnownSolids",
    "observer.maps.evidence": "QUANTUM LIMIT Evidence LinkEvidence reach_of",
    "observer.maps.mean_frames": "MeanFrames stand",
    "observer.maps.noisy_or": "",
    "observer.maps.novelty": "MapNovelty",
    "observer.maps.suspects": "TouchCauses FADE",
    "observer.marginal_kernels": "sweep_free mean_probability match_and_touch settle",
    "observer.matching": "MATCHING",
    "observer.occupancy": "Maps OccupancySnapshot",
    "observer.partners": "Partners mixture",
    "observer.parts": "parts_of",
    "observer.pose_filter": "PoseFilter ContactDynamics",
    "observer.pose_kernels": "",
    "observer.pose_source": "PoseSource",
    "observer.potential_reward": "PotentialReward",
    "observer.set_aside": "Gate",
    "observer.shape_kernels": "contact_likelihood note weigh",
    "observer.shape_posterior": "ShapePosterior Habit Hypotheses NONE",
    "observer.smooth_kernels": "",
    "observer.solid_fields": "Solids Skin skin_of solids_of",
    "observer.solid_variants": "Variants",
    "observer.wrapper": "ObserverWrapper check_rate",
}

RENAMED = (  # classes: the module, the name as version 0.1 had it, and the one that it has now
    ("agents.finger_kinematics", "Reach", "FingerKinematics"),
    ("agents.ornstein_uhlenbeck", "SmoothChance", "OrnsteinUhlenbeck"),
    ("haptic_env.patches", "Skin", "SkinPoints"),
    ("haptic_env.recordings", "Felt", "ObserverInputs"),
    ("haptic_env.recordings.recording", "Felt", "ObserverInputs"),
    ("observer.edge", "Told", "SensedStep"),
    ("observer.maps.capsules", "Reach", "LinkEvidence"),
    ("observer.maps.capsules", "Stance", "MeanFrames"),
    ("observer.maps.contact_model", "Reach", "LinkEvidence"),
    ("observer.maps.matching", "Felt", "MapInput"),
    ("observer.maps.matching_geometry", "Scan", "ScoredSkin"),
    ("observer.maps.matching_geometry", "Suspects", "TouchCauses"),
    ("observer.maps.occupancy", "Change", "UndoRecord"),
    ("observer.maps.occupancy", "Then", "LazyMean"),
    ("observer.maps.scan_matching", "Scan", "ScoredSkin"),
    ("observer.novelty", "Said", "LinkHistory"),
    ("observer.pose.joint_pairs", "Partners", "JointPairs"),
    ("observer.shape.null_model", "Habit", "NullModel"),
    ("observer.shape.pose_correction", "KnownSolids", "PoseCorrection"),
    ("observer.shape.subchains", "Parts", "Subchains"),
)


@pytest.mark.parametrize("old", NAMES)
def test_old_names_work_and_say_where_they_went(old: str) -> None:
    sys.modules.pop(old, None)
    with pytest.warns(DeprecationWarning, match=rf"^{old} is [\w. ]+ now; the old name goes with the next release"):
        module = importlib.import_module(old)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of classes that are called otherwise too
        for name in NAMES[old].split():
            homes = [importlib.import_module(home) for home in _FINDER.homes[old]]
            (found,) = {id(getattr(home, name)): getattr(home, name) for home in homes if hasattr(home, name)}.values()
            assert getattr(module, name) is found
    with pytest.raises(AttributeError, match=f"module '{old}' has no attribute 'nothing_of_the_kind'"):
        _ = module.nothing_of_the_kind


def test_every_old_name_is_tried() -> None:
    assert set(NAMES) == set(_FINDER.homes)
    for old, homes in _FINDER.homes.items():
        assert importlib.util.find_spec(old) is not None
        for home in homes:
            assert importlib.import_module(home).__name__ == home


@pytest.mark.parametrize(("module", "old", "new"), RENAMED)
def test_old_names_of_classes_work_and_say_what_they_are_called_now(module: str, old: str, new: str) -> None:
    home = importlib.import_module(module)
    with pytest.warns(DeprecationWarning, match=rf"\.{old} is {new} now; the old name goes with the next release"):
        found = getattr(home, old)
    assert found is getattr(home, new)
    assert found.__name__ == new
    with pytest.raises(AttributeError, match=f"module '{module}' has no attribute 'nothing_of_the_kind'"):
        _ = home.nothing_of_the_kind


LEFT = {  # where names were in version 0.2, and where they are
    ("observer.fastslam", "observer.configuration"): "LAG_SECONDS RESOLUTION",
    ("observer.kinematics", "observer.jacobians"): "link_spread place_spread point_jacobian twists",
}


@pytest.mark.parametrize(("old", "new"), LEFT)
def test_what_left_a_module_that_is_still_there_is_found_in_it(old: str, new: str) -> None:
    for name in LEFT[old, new].split():
        with pytest.warns(DeprecationWarning, match=rf"^{old}\.{name} is {new}\.{name} now; the old name goes"):
            found = getattr(importlib.import_module(old), name)
        assert found is getattr(importlib.import_module(new), name)


def test_contact_dynamics_are_still_found_beside_the_filter() -> None:
    assert importlib.import_module("observer.pose.kalman").ContactDynamics is observer.ContactDynamics
