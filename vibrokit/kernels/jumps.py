"""What jumps when a stop is touched or left, or where its law changes its sign."""

NOTHING = 0.0
LINEARIZED = 1.0  # the derivatives M, and the covariance
MOMENTA = 2.0
EXTREMALS = 3.0  # momenta and their derivatives
DIVERGING = 4.0  # derivatives of momenta at a touch, which is the end of the motion
