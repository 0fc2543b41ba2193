"""Where modules of version 0.1 are now."""

from haptic_env.moved import moved

moved(
    {
        f"observer.{old}": [f"observer.{name}" for name in new.split()]
        for old, new in {
            "belief_observation": "wrappers.belief_observation",
            "capsules": "maps.capsules maps.contact_model",
            "contact_model": "maps.contact_model",
            "decide_when_sure": "wrappers.decide_when_sure",
            "decision_reward": "wrappers.rewards",
            "delta_pose": "pose.delta_pose",
            "forward_model": "pose.forward_model",
            "hindsight": "maps.hindsight",
            "information_gain_reward": "wrappers.rewards",
            "kernels": "maps.per_particle",
            "kinematic_pose": "pose.smooth_motion",
            "known_kernels": "shape.surface_conditioning shape.distance_fields",
            "known_solids": "shape.pose_correction",
            "maps.evidence": "maps.contact_model",
            "maps.mean_frames": "maps.capsules",
            "maps.noisy_or": "maps.contact_model",
            "maps.novelty": "novelty",
            "maps.suspects": "maps.matching_geometry maps.scan_matching maps.capsules",
            "marginal_kernels": (
                "maps.scan_matching maps.matching_geometry maps.free_space maps.cells maps.capsules jacobians "
                "kinematics"
            ),
            "matching": "maps.matching",
            "occupancy": "maps.occupancy",
            "partners": "pose.joint_pairs gaussian",
            "parts": "shape.subchains",
            "pose_filter": "pose.kalman pose.contact_dynamics",
            "pose_kernels": "pose.kalman_updates pose.contact_forces",
            "pose_source": "pose.source",
            "potential_reward": "wrappers.rewards",
            "set_aside": "pose.gating",
            "shape_kernels": "shape.contact_likelihood novelty",
            "shape_posterior": "shape.posterior shape.null_model shape.hypotheses",
            "smooth_kernels": "pose.interacting_models",
            "solid_fields": "shape.distance_fields shape.skin",
            "solid_variants": "shape.hypotheses",
            "wrapper": "wrappers.observer_wrapper",
        }.items()
    }
)
