"""How fast it is: `haptic-slam bench`; and how time grows with particles, patches and voxels: `haptic-slam scaling`.

`timings` and `stages` time single parts on one recorded exploration (`recording`), `end_to_end` what a user waits for.
`suite` takes them in interleaved rounds, so that what else the machine does meets all of them, and `table` shows their
medians. `reference` is the observer's step once more in plain NumPy, which the compiled one has to agree with.
"""
