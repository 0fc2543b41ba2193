"""Training of policies with Stable-Baselines3: `haptic-slam train`.

A preset (`presets`, TOML) says in which world (`environments`) which algorithm (`learners`) learns, and what it copies
first (`imitation`). `training` runs it, evaluates on sizes of objects that were held out, and goes on from the last
whole checkpoint (`checkpoints`, `replay_buffer`). What comes out, an .npz, is a policy of `agents`, which need none of
this. It needs the extra `train`.
"""
