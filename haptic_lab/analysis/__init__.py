"""What tables of trials say: means with their intervals, calibration, comparisons, ablations."""
