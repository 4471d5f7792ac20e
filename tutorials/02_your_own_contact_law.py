"""
Your own contact law
====================

**Question:** How do I describe a stop that no built-in contact law describes?

Real stops dissipate energy. Hunt and Crossley's law adds a term that depends on the rate
to Hertz's law:

.. math::

   F = k\\,\\delta^{3/2}\\left(1 + \\tfrac32 c\\,\\dot\\delta\\right),

with the depth :math:`\\delta` (m), its rate :math:`\\dot\\delta` (m/s), the stiffness
:math:`k` and the dissipation :math:`c` (s/m). This tutorial writes the law as a formula,
as a class and as a plug-in, shows that all three give the same motion, compares the
energy loss of an impact with a closed form, and tests the law with the conformance kit.

``python tutorials/02_your_own_contact_law.py`` prints the numbers of this page and then
shows its picture in a window. Without a display it only prints.
"""

import math
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq
from sympy import Rational

import vibrokit as vk
from vibrokit.errors import UnknownNameError, VibrokitError
from vibrokit.testing import ConformanceError, check_contact_law

# %%
# As a formula
# ------------
#
# The shortest way is text in ``depth`` and ``rate`` with named constants. The depth is
# the distance past the stop, the rate is positive while the mass moves deeper, and the
# result is the contact force per unit mass. The barrier adds position, side and sign, the
# zero force without contact, and the end of contact where the force would become tensile.
# The text is read as data and never executed.

by_formula = vk.CustomLaw("k*depth**1.5*(1 + 1.5*c*rate)", k=50.0, c=0.2)

# %%
# As a class
# ----------
#
# A class declares each parameter with its symbol, its unit and its range, and it has the
# formula as a method. The class becomes a frozen dataclass. The method is called with
# symbols; derivatives and compiled code are derived from the result. Write the exponent
# as a ``Rational`` or as 1.5, and do not use ``if`` on values.


class HuntCrossley(vk.ContactLaw):
    """Hertz's law with Hunt and Crossley's loss."""

    stiffness: float = vk.parameter("k", "m^(-1/2) s^-2", minimum=0)
    dissipation: float = vk.parameter("c", "s m^-1", minimum=0)

    def force(self, depth, rate):
        """Contact force."""
        elastic = self.stiffness * depth ** Rational(3, 2)
        return elastic * (1 + Rational(3, 2) * self.dissipation * rate)


by_class = HuntCrossley(stiffness=50.0, dissipation=0.2)

# %%
# As a plug-in
# ------------
#
# A plug-in gives the class a name for scene files and for the command line. It is a
# distribution that declares an entry point. These lines of its ``pyproject.toml`` are
# sufficient; vibrokit itself does not change.

PYPROJECT = """
[project]
name = "vibrokit-hunt-crossley"
version = "0.1.0"
dependencies = ["vibrokit>=0.1"]

[project.entry-points."vibrokit.contact_laws"]
hunt-crossley = "vibrokit_hunt_crossley.law:HuntCrossley"
"""

# %%
# This distribution is in ``plugins/vibrokit-hunt-crossley`` and is installed by
# ``python -m pip install ./plugins/vibrokit-hunt-crossley``. Then a scene file can name
# the law.

SCENE_FILE = """
natural_frequency = 1.0
damping_ratio = 0.01

[[barriers]]
law = { name = "hunt-crossley", stiffness = 50.0, dissipation = 0.2 }
position = 0.5
side = "right"

[[barriers]]
law = { name = "hunt-crossley", stiffness = 50.0, dissipation = 0.2 }
position = -0.5
side = "left"

[[excitations]]
name = "harmonic"
amplitude = 0.18
frequency = 0.57

[[excitations]]
name = "constant"
force = 0.2
"""

# %%
# The same motion
# ---------------
#
# The three scenes differ only in the way in which the law is written. Starts that hit the
# stops must have the same images under the section map, up to rounding.


def scene_with(law):
    """Return the scene of the file above with another law."""
    return vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.01,
        barriers=(vk.Barrier(law, 0.5, "right"), vk.Barrier(law, -0.5, "left")),
        excitations=(vk.Harmonic(amplitude=0.18, frequency=0.57), vk.Constant(0.2)),
    )


scenes = {"formula": scene_with(by_formula), "class": scene_with(by_class)}
with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "lossy.toml"
    path.write_text(SCENE_FILE, encoding="utf-8")
    try:
        scenes["plug-in"] = vk.load_scene(path)
    except UnknownNameError as error:
        print("The plug-in is not installed:", error)

starts = np.array([[0.0, -1.5], [0.2, 0.0], [0.3, 0.5], [-0.4, 0.8]])
ends = {way: scene.section_map(starts) for way, scene in scenes.items()}
for way, states in ends.items():
    difference = np.abs(states - ends["formula"]).max()
    print(f"{way:<8} largest difference from the formula {difference:.0e}")

# %%
# The restitution of an impact
# ----------------------------
#
# A free mass without spring, damping and forcing hits a stop at :math:`x = 0` with the
# speed :math:`v`. It rebounds with the speed :math:`e v`. Integrating
# :math:`v\,dv/d\delta = -F` gives an equation for the restitution :math:`e`, in which the
# stiffness does not occur:
#
# .. math::
#
#    a - \ln(1 + a) = -a e - \ln(1 - a e), \qquad a = \tfrac32 c v .
#
# For a small :math:`c v` the solution is :math:`e \approx 1 - c v`.


def free_mass(law):
    """Return a mass on which only a stop at x = 0 acts; 2π is its unit of time."""
    return vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.0,
        spring=vk.LinearSpring(stiffness=0.0),
        barriers=(vk.Barrier(law, 0.0, "right"),),
    )


def restitution(dissipation, speed):
    """Return the ratio of the speeds after and before an impact."""
    mass = free_mass(HuntCrossley(stiffness=50.0, dissipation=dissipation))
    ((_, after),) = mass.section_map([[0.0, speed]], stepper=vk.RK4(steps=8192))
    return -after / speed


def exact_restitution(product):
    """Solve the equation above for c v = `product`."""
    a = 1.5 * product

    def difference(e):
        return a - math.log1p(a) + a * e + math.log1p(-a * e)

    return brentq(difference, 1e-12, min(1.0, (1 - 1e-12) / a), xtol=1e-14)


table = {}
print("c v    1 - c v   restitution   exact")
for product in (0.01, 0.1, 0.4):
    table[product] = restitution(dissipation=product, speed=1.0)
    exact = exact_restitution(product)
    print(f"{product:<5g}  {1 - product:<8g}  {table[product]:.8f}    {exact:.8f}")

# %%
# In the plane of depth and force an impact is a loop. The area of the loop is the energy
# that the impact dissipates. The method of a law accepts numbers as well as symbols.


def bounce(dissipation, speed):
    """Return depth and contact force while the mass is in contact."""
    law = HuntCrossley(stiffness=50.0, dissipation=dissipation)
    mass, fine = free_mass(law), vk.RK4(steps=8192)
    path = mass.trajectory((0.0, speed), duration=2.0, samples=4096, stepper=fine)
    depth, rate = path.x[path.x >= 0], path.v[path.x >= 0]
    force = [float(law.force(*state)) for state in zip(depth, rate, strict=True)]
    return depth, np.array(force)


fig, ax = plt.subplots(layout="constrained")
for dissipation in (0.0, 0.2, 0.4):
    depth, force = bounce(dissipation, speed=1.0)
    area = np.trapezoid(force, depth)
    expected = (1 - exact_restitution(dissipation) ** 2) / 2 if dissipation else 0.0
    ax.plot(depth, force, label=f"$c$ = {dissipation:g} s/m, energy loss {area:.3f}")
    print(f"c = {dissipation:g} s/m: area {area:.6f}, (1 - e²) v²/2 = {expected:.6f}")
ax.set(xlabel=r"depth $\delta$ (m)", ylabel="contact force per unit mass (m/s²)")
ax.legend()

# %%
# Conformance
# -----------
#
# The conformance kit draws parameters from the declared ranges and tests the properties
# that a law must have: no force at rest, derivatives and compiled code against
# differences at 60 digits, and more. ``vibrokit check hunt-crossley`` tests a registered
# law. One check of the kit needs a class in a module that another process can import; it
# is left out for a class in a script.

report = check_contact_law(HuntCrossley)
print(report)

# %%
# Errors
# ------
#
# Wrong input raises an error at once. The message states the name, the value and the
# allowed range. The following class is wrong on purpose: its force is positive before
# contact.


class Pressed(vk.ContactLaw):
    """A stop that is 0.01 nearer than its barrier states."""

    stiffness: float = vk.parameter("k", "s^-2", minimum=0)

    def force(self, depth, rate):
        """Contact force, not zero at depth 0."""
        return self.stiffness * (depth + 0.01)


mistakes = {
    "a negative stiffness": lambda: HuntCrossley(-50.0, 0.2),
    "a dissipation that is not a number": lambda: HuntCrossley(50.0, math.nan),
    "a misspelt name": lambda: vk.CustomLaw("k*depth**1.5*(1 + c*rat)", k=50.0, c=0.2),
    "a formula with code": lambda: vk.CustomLaw("__import__('os').system('echo hi')"),
    "a law with a force at rest": lambda: check_contact_law(Pressed),
}
messages = {}
for name, mistake in mistakes.items():
    try:
        mistake()
    except (VibrokitError, ConformanceError) as error:
        messages[name] = f"{type(error).__name__}: {error}"
        print(f"{name}:\n    {messages[name]}")

# %%
# What you saw
# ------------
#
# * A contact law is one formula, as text, as a class or as a plug-in.
# * All three give the same motion, and the restitution agrees with the closed form.
# * The conformance kit tests a law, and wrong input is refused with a message.
#
# :doc:`/how-to/contact-law` has more on contact laws, :doc:`/how-to/plug-in` on plug-ins.
# The next tutorial, :doc:`03_without_noise`, returns to the scene of the first one.

plt.show()
