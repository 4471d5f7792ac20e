"""Your own contact law

Real stops do not give back all they take. Hunt and Crossley's law adds to Hertz's a loss that grows with the rate at
which the mass goes deeper, :math:`F = k\\,\\delta^{3/2} (1 + \\tfrac32 c\\,\\dot\\delta)`. A slow mass that meets such
a stop with speed :math:`v` comes back with :math:`(1 - c v)\\,v`, whatever the stiffness.

This tutorial writes that law in three ways: as a formula, as a class, and as a plug-in that scene files can name. It
shows that all three are one and the same motion, measures what a bounce costs, has the law examined by the
conformance kit, and looks at what is said when something is wrong.

Run it with ``python tutorials/02_your_own_contact_law.py``; it prints what it finds and saves a picture. What computes
stands in functions, for the kit starts a second Python, which imports this file to get at the class.
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
# The quickest way, in a notebook or a scene file: text in `depth` and `rate`, with constants that you name. The depth
# is how far the mass has gone past the stop, the rate is positive while it goes deeper, and the force is the push on
# the mass. Everything else is the barrier's affair: place, side, sign, no force when apart, and no pull at release.
# The text is read as data and never run, so a scene file from a stranger can do no harm.

BY_FORMULA = vk.CustomLaw("k*depth**1.5*(1 + 1.5*c*rate)", k=50.0, c=0.2)

# ---------------------------------------------------------------------------------------------------------------------
# 2. As a class
#
# The same formula as a method, and each parameter declared once: its symbol in the equations, its unit, its range. The
# class becomes a frozen dataclass by itself. The method is called with symbols in place of numbers, so that derivatives
# and compiled code follow from it; write 3/2 as a Rational, or as 1.5, and no `if` on values.


class HuntCrossley(vk.ContactLaw):
    """Hertz's law with Hunt and Crossley's loss: k δ^(3/2) (1 + (3/2) c δ′)."""

    stiffness: float = vk.parameter("k", "m^(-1/2) s^-2", minimum=0)
    dissipation: float = vk.parameter("c", "s m^-1", minimum=0)

    def force(self, depth, rate):
        """Push on the mass."""
        return self.stiffness * depth ** Rational(3, 2) * (1 + Rational(3, 2) * self.dissipation * rate)


BY_CLASS = HuntCrossley(stiffness=50.0, dissipation=0.2)

# ---------------------------------------------------------------------------------------------------------------------
# 3. As a plug-in
#
# To use the class by name, in scene files and on the command line, put it into a distribution that declares an entry
# point. Nothing in vibrokit changes. These lines of its pyproject.toml do it:

PYPROJECT = """
[project]
name = "vibrokit-hunt-crossley"
version = "0.1.0"
dependencies = ["vibrokit>=0.1"]

[project.entry-points."vibrokit.contact_laws"]
hunt-crossley = "vibrokit_hunt_crossley.law:HuntCrossley"
"""

# That distribution exists, in plugins/vibrokit-hunt-crossley; its law has the exponent as a third parameter, 3/2 unless
# given. Once it is installed, the law has a name like any other:

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
# 4. One motion
#
# The three scenes differ in how the law was written and in nothing else. From some starts that hit both stops, over
# one period of the forcing, the states must agree to rounding.


def scene_with(law):
    """Return the scene of the file above with another law."""
    return vk.Oscillator(
        natural_frequency=1.0,
        damping_ratio=0.01,
        barriers=(vk.Barrier(law, 0.5, "right"), vk.Barrier(law, -0.5, "left")),
        excitations=(vk.Harmonic(amplitude=0.18, frequency=0.57), vk.Constant(force=0.2)),
    )


def compare_ways():
    """Return the states after one period, for each way that is at hand."""
    scenes = {"formula": scene_with(BY_FORMULA), "class": scene_with(BY_CLASS), "plug-in": scene_by_plugin()}
    starts = np.array([[0.0, -1.5], [0.2, 0.0], [0.3, 0.5], [-0.4, 0.8]])
    ends = {way: scene.section_map(starts) for way, scene in scenes.items() if scene is not None}
    for way, states in ends.items():
        print(f"by {way:<8} differs from the formula by {np.abs(states - ends['formula']).max():.1g}")
    return ends


# ---------------------------------------------------------------------------------------------------------------------
# 5. What a bounce costs
#
# A free mass (no spring, no damping, no forcing) meets a stop at x = 0 and leaves it. The loss shows as a loop in the
# plane of depth and force, whose area is the energy that the bounce has cost.


def free_mass(law):
    """Return a mass that nothing acts on but a stop at x = 0."""
    return vk.Oscillator(
        natural_frequency=1.0,  # sets the unit of time only: 2π
        damping_ratio=0.0,
        spring=vk.LinearSpring(stiffness=0.0),
        barriers=(vk.Barrier(law, 0.0, "right"),),
    )


def restitution(dissipation, speed):
    """Return speed after over speed before, of a mass that starts at the stop."""
    mass = free_mass(HuntCrossley(stiffness=50.0, dissipation=dissipation))
    ((_, after),) = mass.section_map([[0.0, speed]], stepper=vk.RK4(steps=8192))
    return -after / speed


def bounce(dissipation, speed):
    """Return depth and push while in contact. The method of a law takes numbers as well as symbols."""
    law = HuntCrossley(stiffness=50.0, dissipation=dissipation)
    path = free_mass(law).trajectory((0.0, speed), duration=2.0, samples=4096, stepper=vk.RK4(steps=8192))
    depth, rate = path.x[path.x >= 0], path.v[path.x >= 0]
    return depth, np.array([float(law.force(*state)) for state in zip(depth, rate, strict=True)])


def measure_bounces():
    """Return the restitution at some speeds, and the energy that a bounce costs by speeds and by the loop's area."""
    print("c v      1 - c v    restitution")
    table = {}
    for product in (0.01, 0.1, 0.4):
        table[product] = restitution(dissipation=product, speed=1.0)
        print(f"{product:<7g}  {1 - product:<9.4f}  {table[product]:.6f}")
    depth, force = bounce(dissipation=0.2, speed=1.0)
    area = np.trapezoid(force, depth)
    cost = (1 - restitution(dissipation=0.2, speed=1.0) ** 2) / 2
    print(f"a bounce at c v = 0.2 costs {cost:.6f} of 0.5; the loop has the area {area:.6f}")
    return SimpleNamespace(restitution=table, cost=cost, area=area)


# ---------------------------------------------------------------------------------------------------------------------
# 6. Examined
#
# The conformance kit draws parameters from the declared ranges and looks at all that a law must keep to: no force at
# rest, never a pull, derivatives and compiled code against differences at 60 digits, and more. In a test of yours one
# line does it. The registered ones are examined by name: `vibrokit check hunt-crossley`.


def examine():
    """Return what the kit says of the class."""
    report = check_contact_law(HuntCrossley)
    print(report)
    return report


# ---------------------------------------------------------------------------------------------------------------------
# 7. When something is wrong
#
# What is refused is refused at once, with the name, the value, and what would be right.


class Pressed(vk.ContactLaw):
    """Wrong on purpose: it pushes before anything touches."""

    stiffness: float = vk.parameter("k", "s^-2", minimum=0)

    def force(self, depth, rate):
        """Push on the mass, as if the stop stood 0.01 nearer than its barrier says."""
        return self.stiffness * (depth + 0.01)


MISTAKES = {
    "a negative stiffness": lambda: HuntCrossley(stiffness=-50.0, dissipation=0.2),
    "a dissipation that is no number": lambda: HuntCrossley(stiffness=50.0, dissipation=math.nan),
    "a slip of the pen": lambda: vk.CustomLaw("k*depth**1.5*(1 + 1.5*c*rat)", k=50.0, c=0.2),
    "a formula that tries to run code": lambda: vk.CustomLaw("__import__('os').system('echo got in')"),
    "a law that pushes at rest": lambda: check_contact_law(Pressed),
}


def make_mistakes():
    """Return what is said of each mistake."""
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
    """Draw force against depth through a bounce, for three dissipations; the enclosed area is the energy lost."""
    for dissipation in (0.0, 0.2, 0.4):
        depth, force = bounce(dissipation, speed=1.0)
        axes.plot(depth, force, linewidth=1.2, label=f"$c$ = {dissipation:g} s/m")
    axes.set_xlabel(r"depth $\delta$ (m)")
    axes.set_ylabel(r"push on the mass (m s$^{-2}$)")
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
    """Run every section and return what was found."""
    return SimpleNamespace(ends=compare_ways(), bounces=measure_bounces(), report=examine(), said=make_mistakes())


if __name__ == "__main__":
    main()
    save_picture(Path.cwd() / "tutorial-pictures")
