"""What policies that look ahead need to have compiled (`observer.compiling`)."""

from __future__ import annotations

import numpy as np

from agents import lookahead, rollouts
from agents.finger_kinematics import FingerKinematics
from agents.map_lookahead import expected
from haptic_env.grid import Grid
from haptic_env.hand import Hand
from observer import ShapePosterior
from observer.maps.capsules import lattice_of
from observer.pose.forward_model import ForwardModel


def looking_ahead(hand: Hand) -> None:
    """Compile what `information_gain` needs, for names and for maps.

    Args:
        hand: any.
    """
    rest = hand.rest_pose.astype(np.float64)
    FingerKinematics(hand).strokes(rest, hand.grasp_centre)
    ahead = ForwardModel(hand, 50.0).predict(np.concatenate([rest, np.zeros(hand.joints)]), np.zeros(hand.joints))
    low, high = (np.ascontiguousarray(each) for each in hand.joint_limits.T)
    line = rollouts.Line(ahead.state.copy(), ahead.state, ahead.transition, ahead.torque_gain, low, high)
    shape = ShapePosterior(hand)
    solids, log_weights, label = shape.hypotheses
    torques, left = np.zeros((1, hand.joints)), np.empty((1, 1))
    of_hand = rollouts.hand_of(hand)
    worlds = lookahead.Worlds(solids, log_weights, label, np.zeros(1, dtype=np.int64))
    plan = rollouts.Plan(line, torques, 1, 1)
    told = lookahead.LookaheadModel(0.002, shape.surprise, shape.temper, shape.said, 0.008)
    lookahead.class_entropies(0, 1, of_hand, worlds, plan, told, left)
    points, body = np.zeros((1, 3)), np.zeros(1, dtype=np.int64)
    lattice, map = lattice_of(Grid((0.0, 0.0, 0.0), 0.004, (2, 2, 2))), np.zeros((2, 2, 2))
    expected(of_hand.tree, points, body, body, np.tile(rest, (1, 2, 1)), lattice, map, map)
