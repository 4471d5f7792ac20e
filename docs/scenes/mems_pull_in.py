"""
Pull-in of an electrostatic actuator
====================================

A plate on a spring is attracted by a voltage across a gap :math:`h`. Above the pull-in voltage no equilibrium is left
and the plate snaps to the electrode. Below it, noise can still drive the plate over the potential barrier. The numbers
are those of set 2 of the transducers in V. Kolchuzhin's LMGT_MEMS_component_library: mass 1e-4 kg, spring 200 N/m,
plates of 1 cm² with a gap of 150 µm.
"""

import matplotlib.pyplot as plt
import numpy as np

import vibrokit as vk

mass, stiffness, dashpot, area, gap = 1e-4, 200.0, 0.04, 1e-4, 150e-6  # kg, N/m, N s/m, m², m
square, permittivity = stiffness / mass, 8.8541878e-12  # s⁻², F/m


def strength(voltage):
    """Attraction times the square of the distance, per unit mass (m³ s⁻²)."""
    return permittivity * area * voltage**2 / (2 * mass)


osc = vk.Oscillator(
    natural_frequency=np.sqrt(square),
    damping_ratio=dashpot / (2 * mass * np.sqrt(square)),
    spring=vk.CustomSpring("w2*x - a/(h - x)**2", w2=square, a=strength(400.0), h=gap),
    noise=vk.WhiteNoise(intensity=0.05),
)
search = vk.LeastAction(shooting=None, graph=vk.GraphSearch(nodes=(40, 40)))
voltages, energies = (300.0, 400.0, 450.0), []
for voltage in voltages:
    loaded = osc.replace({"spring.a": strength(voltage)})
    structure = vk.find_structure(loaded, cells=(40, 40), starts=(8, 8), manifolds=False)
    energies.append(search.run(loaded, structure).energies[0].value)

# %%
# With linear damping and white noise, :math:`\Delta U = 4\zeta\omega_n\,\Delta V`, where :math:`\Delta V` is the
# height of the barrier of :math:`V = \tfrac12\omega_n^2 x^2 - a/(h - x)`. It vanishes at the pull-in voltage.


def closed_form(voltage):
    """4ζω_n times the barrier between the rest and the saddle, the two roots of ω_n² x (h − x)² = a below the gap."""
    roots = np.roots([square, -2 * square * gap, square * gap**2, -strength(voltage)]).real
    rest, saddle = sorted(roots)[:2]
    potential = square * np.array([rest, saddle]) ** 2 / 2 - strength(voltage) / (gap - np.array([rest, saddle]))
    return 2 * dashpot / mass * (potential[1] - potential[0])


pull_in = np.sqrt(8 / 27 * stiffness * gap**3 / (permittivity * area))
fig, ax = plt.subplots(layout="constrained")
fine = np.linspace(250.0, pull_in - 0.01, 200)
ax.plot(fine, [closed_form(voltage) for voltage in fine], color="0.5", label="closed form")
ax.plot(voltages, energies, "o", label="least action")
ax.axvline(pull_in, color="0.5", linestyle=":", label="pull-in")
ax.set_xlabel("voltage (V)")
ax.set_ylabel(r"activation energy $\Delta U$ (m$^2$ s$^{-3}$)")
legend = ax.legend()

# %%
# Pull-in is a fold at :math:`x = h/3`, where :math:`a = \tfrac{4}{27}\omega_n^2 h^3`.

sweep = vk.continuation(osc, "spring.a", np.linspace(3e-7, 1.3e-6, 6), cells=(10, 10), starts=(8, 8))
(fold,) = sweep.bifurcations
print(f"{fold.kind} at a = {fold.value:.10e} m³ s⁻²; closed form: {4 / 27 * square * gap**3:.10e}")
print(f"    x = {1e6 * fold.point[0]:.4f} µm; closed form: {1e6 * gap / 3:.4f} µm, {pull_in:.3f} V")
assert abs(fold.value / (4 / 27 * square * gap**3) - 1) < 1e-6
assert np.allclose(energies, [closed_form(voltage) for voltage in voltages], rtol=1e-6)
