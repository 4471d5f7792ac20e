"""Your own contact law

Real stops dissipate energy. Hunt and Crossley's law adds a rate-dependent term to Hertz's law,
:math:`F = k\\,\\delta^{3/2} (1 + \\tfrac32 c\\,\\dot\\delta)`. A slow mass that hits such a stop with speed :math:`v`
rebounds with :math:`(1 - c v)\\,v`, for any stiffness.

This tutorial writes the law in three ways: as a formula, as a class, and as a plug-in that scene files can name. It
shows that all three give the same motion, measures the energy loss of an impact, tests the law with the conformance
kit, and shows the error messages for wrong input.

Run it with ``python tutorials/02_your_own_contact_law.py``. It prints its results and saves a picture. The computations
are in functions because the conformance kit starts a second Python process that imports this file.
"""

import math
import tempfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from sympy import Rational

import vibrokit as vk
from vibrokit.errors import UnknownNameError, VibrokitError
from vibrokit.testing import ConformanceError, check_contact_law

# ---------------------------------------------------------------------------------------------------------------------
# 1. As a formula
#
# The quickest way, for a notebook or a scene file, is text in `depth` and `rate` with named constants. The depth is the
# distance past the stop, the rate is positive while the mass moves deeper, and the result is the contact force. The
# barrier takes care of the rest: position, side, sign, zero force without contact, and no tensile force at release. The
# text is read as data and never executed, so scene files from unknown sources are safe.

BY_FORMULA = vk.CustomLaw("k*depth**1.5*(1 + 1.5*c*rate)", k=50.0, c=0.2)

# ---------------------------------------------------------------------------------------------------------------------
# 2. As a class
#
# The formula becomes a method. Each parameter is declared once, with its symbol in the equations, its unit and its
# range. The class becomes a frozen dataclass automatically. The method is called with symbols, from which derivatives
# and compiled code are derived. Write 3/2 as a Rational or as 1.5, and do not use `if` on values.


class HuntCrossley(vk.ContactLaw):
    """Hertz's law with Hunt and Crossley's loss: k δ^(3/2) (1 + (3/2) c δ′)."""

    stiffness: float = vk.parameter("k", "m^(-1/2) s^-2", minimum=0)
    dissipation: float = vk.parameter("c", "s m^-1", minimum=0)

    def force(self, depth, rate):
        """Contact force."""
        return self.stiffness * depth ** Rational(3, 2) * (1 + Rational(3, 2) * self.dissipation * rate)


BY_CLASS = HuntCrossley(stiffness=50.0, dissipation=0.2)

# ---------------------------------------------------------------------------------------------------------------------
# 3. As a plug-in
#
# To use the class by name in scene files and on the command line, put it into a distribution that declares an entry
# point. No change in vibrokit is needed. These lines of its pyproject.toml are sufficient:

PYPROJECT = """
[project]
name = "vibrokit-hunt-crossley"
version = "0.1.0"
dependencies = ["vibrokit>=0.1"]

[project.entry-points."vibrokit.contact_laws"]
hunt-crossley = "vibrokit_hunt_crossley.law:HuntCrossley"
"""

# This distribution exists in plugins/vibrokit-hunt-crossley; its law has the exponent as a third parameter, by default
# 3/2. After installation, scene files can use its name:

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


def scene_by_plugin():
    """Return the scene of the file above, or None if the plug-in is not installed."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "lossy.toml"
        path.write_text(SCENE_FILE, encoding="utf-8")
        try:
            return vk.load_scene(path)
        except UnknownNameError as error:
            print(f"{error}\nInstall it with: python -m pip install ./plugins/vibrokit-hunt-crossley")
            return None


# ---------------------------------------------------------------------------------------------------------------------
# 4. The same motion
#
# The three scenes differ only in how the law is written. From starts that hit both stops, the states after one forcing
# period must agree to rounding.


def scene_with(law):
    """Return the scene of the file above with another law."""
    return vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.01,
        barriers=(vk.Barrier(law, 0.5, "right"), vk.Barrier(law, -0.5, "left")),
        excitations=(vk.Harmonic(amplitude=0.18, frequency=0.57), vk.Constant(force=0.2)),
    )


def compare_ways():
    """Return the states after one period, for each way that is available."""
    scenes = {"formula": scene_with(BY_FORMULA), "class": scene_with(BY_CLASS), "plug-in": scene_by_plugin()}
    starts = np.array([[0.0, -1.5], [0.2, 0.0], [0.3, 0.5], [-0.4, 0.8]])
    ends = {way: scene.section_map(starts) for way, scene in scenes.items() if scene is not None}
    for way, states in ends.items():
        print(f"by {way:<8} differs from the formula by {np.abs(states - ends['formula']).max():.1g}")
    return ends


# ---------------------------------------------------------------------------------------------------------------------
# 5. Energy loss of an impact
#
# A free mass (no spring, no damping, no forcing) hits a stop at x = 0 and rebounds. In the plane of depth and force the
# impact is a loop. Its area is the energy loss.


def free_mass(law):
    """Return a mass on which only a stop at x = 0 acts."""
    return vk.Oscillator(
        natural_frequency=1.0,  # sets the unit of time only: 2π
        damping_ratio=0.0,
        spring=vk.LinearSpring(stiffness=0.0),
        barriers=(vk.Barrier(law, 0.0, "right"),),
    )


def restitution(dissipation, speed):
    """Return the ratio of the speeds after and before an impact."""
    mass = free_mass(HuntCrossley(stiffness=50.0, dissipation=dissipation))
    ((_, after),) = mass.section_map([[0.0, speed]], stepper=vk.RK4(steps=8192))
    return -after / speed


def bounce(dissipation, speed):
    """Return depth and force during contact. The method of a law accepts numbers as well as symbols."""
    law = HuntCrossley(stiffness=50.0, dissipation=dissipation)
    path = free_mass(law).trajectory((0.0, speed), duration=2.0, samples=4096, stepper=vk.RK4(steps=8192))
    depth, rate = path.x[path.x >= 0], path.v[path.x >= 0]
    return depth, np.array([float(law.force(*state)) for state in zip(depth, rate, strict=True)])


def measure_bounces():
    """Return the restitution for some dissipations, and the energy loss from the speeds and from the loop's area."""
    print("c v      1 - c v    restitution")
    table = {}
    for product in (0.01, 0.1, 0.4):
        table[product] = restitution(dissipation=product, speed=1.0)
        print(f"{product:<7g}  {1 - product:<9.4f}  {table[product]:.6f}")
    depth, force = bounce(dissipation=0.2, speed=1.0)
    area = np.trapezoid(force, depth)
    cost = (1 - restitution(dissipation=0.2, speed=1.0) ** 2) / 2
    print(f"an impact at c v = 0.2 dissipates {cost:.6f} of 0.5; the area of the loop is {area:.6f}")
    return SimpleNamespace(restitution=table, cost=cost, area=area)


# ---------------------------------------------------------------------------------------------------------------------
# 6. Conformance
#
# The conformance kit draws parameters from the declared ranges and tests all properties that a law must have: no force
# at rest, no tensile force, derivatives and compiled code against differences at 60 digits, and more. One line in a
# test runs it. Registered laws are tested by name: `vibrokit check hunt-crossley`.


def examine():
    """Return the conformance report of the class."""
    report = check_contact_law(HuntCrossley)
    print(report)
    return report


# ---------------------------------------------------------------------------------------------------------------------
# 7. Errors
#
# Wrong input raises an error at once. It states the name, the value and what is allowed.


class Pressed(vk.ContactLaw):
    """Wrong on purpose: its force is positive before contact."""

    stiffness: float = vk.parameter("k", "s^-2", minimum=0)

    def force(self, depth, rate):
        """Contact force, as if the stop were 0.01 nearer than its barrier states."""
        return self.stiffness * (depth + 0.01)


MISTAKES = {
    "a negative stiffness": lambda: HuntCrossley(stiffness=-50.0, dissipation=0.2),
    "a dissipation that is not a number": lambda: HuntCrossley(stiffness=50.0, dissipation=math.nan),
    "a misspelt name": lambda: vk.CustomLaw("k*depth**1.5*(1 + 1.5*c*rat)", k=50.0, c=0.2),
    "a formula that tries to run code": lambda: vk.CustomLaw("__import__('os').system('echo got in')"),
    "a law with a force at rest": lambda: check_contact_law(Pressed),
}


def make_mistakes():
    """Return the error message of each mistake."""
    said = {}
    for what, mistake in MISTAKES.items():
        try:
            mistake()
        except (VibrokitError, ConformanceError) as error:
            said[what] = f"{type(error).__name__}: {error}"
            print(f"{what}:\n    {said[what]}")
    return said


# ---------------------------------------------------------------------------------------------------------------------
# 8. The picture


def draw_loops(axes):
    """Draw force against depth during an impact, for three dissipations; the enclosed area is the energy loss."""
    for dissipation in (0.0, 0.2, 0.4):
        depth, force = bounce(dissipation, speed=1.0)
        axes.plot(depth, force, linewidth=1.2, label=f"$c$ = {dissipation:g} s/m")
    axes.set_xlabel(r"depth $\delta$ (m)")
    axes.set_ylabel(r"contact force (m s$^{-2}$)")
    axes.legend(fontsize=8)


def save_picture(folder):
    """Save the picture in a folder and print where it is."""
    from matplotlib.figure import Figure

    folder.mkdir(exist_ok=True)
    figure = Figure(figsize=(6.0, 4.2), layout="constrained")
    draw_loops(figure.add_subplot())
    figure.savefig(folder / "02-bounce.png", dpi=150)
    print("picture:", folder / "02-bounce.png")


def main():
    """Run every section and return the results."""
    return SimpleNamespace(ends=compare_ways(), bounces=measure_bounces(), report=examine(), said=make_mistakes())


if __name__ == "__main__":
    main()
    save_picture(Path.cwd() / "tutorial-pictures")
