"""The conformance kit: checks that a part behaves as the toolkit expects.

For developers
--------------
Give a class, and random parameters are drawn from its declared ranges; or give an instance. In a test::

    from vibrokit.testing import check_contact_law
    check_contact_law(MyLaw)                                    # all checks; raises if any fails

    @pytest.mark.parametrize(("name", "check"), contact_law_checks(MyLaw))
    def test_law(name, check):                                  # or one test per check
        check()

The kit does not need pytest. From a shell: ``vibrokit check NAME``.
"""

from __future__ import annotations

from typing import Any

from vibrokit.errors import UnknownNameError, nearest
from vibrokit.parts.contact import ContactLaw
from vibrokit.parts.excitation import Excitation
from vibrokit.parts.friction import Friction
from vibrokit.parts.noise import NoiseModel
from vibrokit.parts.spring import Spring
from vibrokit.registry import load, names
from vibrokit.testing.contact import ContactLawChecks
from vibrokit.testing.excitations import ExcitationChecks
from vibrokit.testing.noise import NoiseModelChecks
from vibrokit.testing.part_checks import PartChecks, Rng
from vibrokit.testing.report import Check, ConformanceError, Outcome, Report, raise_failures, run_checks
from vibrokit.testing.state_forces import FrictionChecks, SpringChecks

__all__ = [
    "KINDS",
    "Check",
    "ConformanceError",
    "Outcome",
    "Report",
    "check",
    "check_contact_law",
    "check_excitation",
    "check_friction",
    "check_noise_model",
    "check_spring",
    "contact_law_checks",
    "excitation_checks",
    "friction_checks",
    "noise_model_checks",
    "spring_checks",
]

KINDS: tuple[type[PartChecks[Any]], ...] = (
    ContactLawChecks,
    SpringChecks,
    FrictionChecks,
    ExcitationChecks,
    NoiseModelChecks,
)
"""The checks of each kind of part."""


def check_contact_law(law: ContactLaw | type[ContactLaw], *, rng: Rng = 0) -> Report:
    """Check a contact law.

    Parameters
    ----------
    law : ContactLaw, or a subclass
        A class is checked with random parameter values from the declared ranges. An instance is checked as it is, and
        with random values of those of its parameters that declare a range.
    rng : int or numpy.random.Generator, optional
        For random values and points; the same by default at every call.

    Returns
    -------
    Report

    Raises
    ------
    ConformanceError
        One or more checks failed; the message lists all of them.
    """
    return raise_failures(_report(ContactLawChecks(law, rng)))


def check_spring(spring: Spring | type[Spring], *, rng: Rng = 0) -> Report:
    """Check a spring; arguments, result and errors as for `check_contact_law`."""
    return raise_failures(_report(SpringChecks(spring, rng)))


def check_friction(friction: Friction | type[Friction], *, rng: Rng = 0) -> Report:
    """Check a friction; arguments, result and errors as for `check_contact_law`."""
    return raise_failures(_report(FrictionChecks(friction, rng)))


def check_excitation(excitation: Excitation | type[Excitation], *, rng: Rng = 0) -> Report:
    """Check an excitation; arguments, result and errors as for `check_contact_law`."""
    return raise_failures(_report(ExcitationChecks(excitation, rng)))


def check_noise_model(noise: NoiseModel | type[NoiseModel], *, rng: Rng = 0) -> Report:
    """Check a noise model; arguments, result and errors as for `check_contact_law`."""
    return raise_failures(_report(NoiseModelChecks(noise, rng)))


def contact_law_checks(law: ContactLaw | type[ContactLaw], *, rng: Rng = 0) -> tuple[Check, ...]:
    """Return the checks of `check_contact_law`, each a pair (name, function that raises ConformanceError)."""
    return ContactLawChecks(law, rng).checks()


def spring_checks(spring: Spring | type[Spring], *, rng: Rng = 0) -> tuple[Check, ...]:
    """Return the checks of `check_spring`, each a pair (name, function that raises ConformanceError)."""
    return SpringChecks(spring, rng).checks()


def friction_checks(friction: Friction | type[Friction], *, rng: Rng = 0) -> tuple[Check, ...]:
    """Return the checks of `check_friction`, each a pair (name, function that raises ConformanceError)."""
    return FrictionChecks(friction, rng).checks()


def excitation_checks(excitation: Excitation | type[Excitation], *, rng: Rng = 0) -> tuple[Check, ...]:
    """Return the checks of `check_excitation`, each a pair (name, function that raises ConformanceError)."""
    return ExcitationChecks(excitation, rng).checks()


def noise_model_checks(noise: NoiseModel | type[NoiseModel], *, rng: Rng = 0) -> tuple[Check, ...]:
    """Return the checks of `check_noise_model`, each a pair (name, function that raises ConformanceError)."""
    return NoiseModelChecks(noise, rng).checks()


def check(name: str, *, rng: Rng = 0) -> Report:
    """Check every part that is registered under a name; failures are in the report and raise nothing.

    Raises
    ------
    UnknownNameError
        No part has this name.
    """
    known = {kind: {entry.name for entry in names(kind.group)} for kind in KINDS}
    reports = [_report(kind(load(kind.group, name, kind.kind), rng)) for kind in KINDS if name in known[kind]]
    if not reports:
        raise UnknownNameError(f"There is no part {name!r} to check{nearest(name, set().union(*known.values()))}")
    return Report(tuple(outcome for report in reports for outcome in report.outcomes))


def _report(checks: PartChecks[Any]) -> Report:
    noun = checks.group.noun
    return run_checks(f"{checks.cls.__name__}, {'an' if noun[0] == 'e' else 'a'} {noun}", checks.checks())
