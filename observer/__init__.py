"""The observer: where the hand is, what shape the object has, what it is, and how sure one may be."""

from observer.belief import Belief
from observer.belief_observation import BeliefFeatures, BeliefObservation
from observer.brackets import OBSERVERS, DeadReckoning, Kalman, Smoother, TruePose
from observer.contact_model import ContactModel
from observer.decide_when_sure import DecideWhenSure
from observer.decision_reward import DecisionReward
from observer.fastslam import HapticSLAM
from observer.information_gain_reward import InformationGainReward
from observer.misfit import ContactsDoNotFit
from observer.pose_filter import ContactDynamics
from observer.pose_only import PoseOnly
from observer.shape_posterior import ShapePosterior
from observer.warming import warm_up
from observer.wrapper import ObserverWrapper

__all__ = [
    "OBSERVERS",
    "Belief",
    "BeliefFeatures",
    "BeliefObservation",
    "ContactDynamics",
    "ContactModel",
    "ContactsDoNotFit",
    "DeadReckoning",
    "DecideWhenSure",
    "DecisionReward",
    "HapticSLAM",
    "InformationGainReward",
    "Kalman",
    "ObserverWrapper",
    "PoseOnly",
    "ShapePosterior",
    "Smoother",
    "TruePose",
    "warm_up",
]
