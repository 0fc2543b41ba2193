"""The observer: where the hand is, what shape the object has, what it is, and how sure one may be."""

from observer.belief import Belief
from observer.brackets import OBSERVERS, DeadReckoning, Kalman, Smoother, TruePose
from observer.contact_model import ContactModel
from observer.fastslam import HapticSLAM
from observer.pose_filter import ContactDynamics
from observer.shape_posterior import ShapePosterior
from observer.wrapper import ObserverWrapper

__all__ = [
    "OBSERVERS",
    "Belief",
    "ContactDynamics",
    "ContactModel",
    "DeadReckoning",
    "HapticSLAM",
    "Kalman",
    "ObserverWrapper",
    "ShapePosterior",
    "Smoother",
    "TruePose",
]
