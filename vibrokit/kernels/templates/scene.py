"""A hand-written sample of what stands above the templates, so that they can be read and checked.

The sizes are those of flows of a scene with two states and stops. What the driver calls in other modules is in
`vibrokit.kernels.links`.
"""

STATES = 2
STOPS = True
ORDER, TERMS = 22, 23

LANES = 8
# Numbers of a block of lanes, each in a row of lanes. Of a state (t, z), these are the places of z; so are those of the
# slopes of the first stage.
ROW, CLOCK = 22, -1  # rows of a state, enough for every flow; the row of t
STATE, TRIAL = 8, 200  # states before and after an attempt
LENGTHS, POINT = 392, 584  # of the attempt, for each number; the point of a stage
SIZES, FIFTHS, THIRDS = 776, 968, 1160  # sizes of the numbers, and estimates of their errors
SLOPES = 1352  # at all stages
LENGTH, ERROR, FACTOR = 3648, 3656, 3664  # of the attempt; its error by the tolerance; by what to lengthen the next
SIGMA, COURSE, ROOT, WALL, SIDE = 3672, 3680, 3688, 3696, 3704  # the course, and the stop that is touched
GRAIN, DEPTH, NEAR = 3712, 3720, 3728  # rounding of x at a stop
ALLOWED, HAZE = 3736, 3744  # the tolerance that it allows, and how uncertain derivatives are because of it
MOST = 3752  # the largest estimates, and whether a number is not finite
NUMBERS = 3776
PUSHES = -8  # whether the first stop pushes; the others stand before it
