"""Speed and accuracy against peers, as ratios within one run: absolute times differ by machine."""
