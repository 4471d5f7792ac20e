"""
Five steady states of one equation
==================================

Ueda's oscillator has a cubic spring without a linear part. At weak damping and forcing it has five steady states at
once, of periods 1, 1, 2, 2 and 3. Two of them have basins of 3 % of the region, and are easily missed. J. M. T.
Thompson and H. B. Stewart show them in *Nonlinear Dynamics and Chaos* (Wiley); the toolboxes bSTAB and pybasin use
them as a test.
"""

import matplotlib.pyplot as plt
import numpy as np

import vibrokit as vk

osc = vk.Oscillator(
    natural_frequency=1.0,  # sets the damping 2ζω_n alone
    damping_ratio=0.04,
    spring=vk.CubicSpring(linear=0.0, cubic=1.0),
    excitations=(vk.Harmonic(amplitude=0.2, frequency=1.0),),
)
structure = vk.find_structure(osc, region=((-1, 1), (-0.5, 1)), cells=(300, 300), saddles=False)
print(structure)

# %%
# Colours are basins of attraction, dots the points of the steady states at :math:`t = 0` mod :math:`T`. One steady
# state lies outside the region.

fig, ax = plt.subplots(figsize=(6.8, 4.8), layout="constrained")
drawn = structure.plot(ax=ax)

# %%
# bSTAB counts 10 000 random starts in this region. Its standard errors are at most 0.005, and 0.0017 for the two small
# basins. The tolerances are about three standard errors.

published = {  # a point of the steady state: its share, tolerance
    (-0.21, 0.02): (0.2025, 0.012),
    (1.05, 0.79): (0.495, 0.015),
    (-0.67, 0.02): (0.0288, 0.005),
    (-0.45, 0.29): (0.0257, 0.005),
    (-0.43, 0.12): (0.248, 0.012),
}
assert sorted(state.period for state in structure.attractors) == [1, 1, 2, 2, 3]
for point, (share, tolerance) in published.items():
    state = min(structure.attractors, key=lambda each: np.linalg.norm(each.points - point, axis=1).min())
    print(f"{state.name}: share {state.basin_fraction:.4f}; bSTAB: {share}")
    assert abs(state.basin_fraction - share) < tolerance
