"""Networks against finite elements that are graded to the corners, and the training of the paper."""
