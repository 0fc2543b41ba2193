"""What is to be learnt: environments with a belief and a reward, and the worlds in which policies are judged.

`gym.make("HapticSLAM/Name-v0")` and the like make a `TaskEnv` (`environment`) of a world of `registry`.
"""
