"""The observer: where the hand is, what shape the object has, what it is, and how sure one may be."""

from observer import old_names  # noqa: F401 - keeps them importable
from observer.belief import Belief
from observer.brackets import OBSERVERS, DeadReckoning, Kalman, Smoother, TruePose, White
from observer.fastslam import HapticSLAM
from observer.library import DamagedEntry, Library
from observer.maps.contact_model import ContactModel
from observer.pose.contact_dynamics import ContactDynamics
from observer.pose_only import PoseOnly
from observer.second_look import SecondLook
from observer.shape.misfit import ContactsDoNotFit
from observer.shape.posterior import ShapePosterior
from observer.warming import warm_up
from observer.wrappers.belief_observation import BeliefFeatures, BeliefObservation
from observer.wrappers.decide_when_sure import DecideWhenSure
from observer.wrappers.observer_wrapper import ObserverWrapper
from observer.wrappers.rewards import DecisionReward, InformationGainReward

__all__ = [
    "OBSERVERS",
    "Belief",
    "BeliefFeatures",
    "BeliefObservation",
    "ContactDynamics",
    "ContactModel",
    "ContactsDoNotFit",
    "DamagedEntry",
    "DeadReckoning",
    "DecideWhenSure",
    "DecisionReward",
    "HapticSLAM",
    "InformationGainReward",
    "Kalman",
    "Library",
    "ObserverWrapper",
    "PoseOnly",
    "SecondLook",
    "ShapePosterior",
    "Smoother",
    "TruePose",
    "White",
    "warm_up",
]
