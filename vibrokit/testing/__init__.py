"""The conformance kit: does a part of yours behave as parts must?

For developers
--------------
Give a class, and random parameters are drawn from the ranges that it declares; or give an instance. In a test::

    from vibrokit.testing import check_contact_law
    check_contact_law(MyLaw)                                    # all checks; raises with what does not hold

    @pytest.mark.parametrize(("name", "check"), contact_law_checks(MyLaw))
    def test_law(name, check):                                  # or one test for each
        check()

The kit needs no pytest. From a shell: ``vibrokit check NAME``.
"""

from __future__ import annotations

from vibrokit.errors import UnknownNameError, nearest
from vibrokit.parts.contact.contact_law import ContactLaw
from vibrokit.parts.excitation.excitation import Excitation
from vibrokit.parts.noise.noise_model import NoiseModel
from vibrokit.parts.part import Part
from vibrokit.parts.spring.spring import Spring
from vibrokit.registry import load, names
from vibrokit.testing.contact import ContactLawChecks
from vibrokit.testing.excitation import ExcitationChecks
from vibrokit.testing.noise_model import NoiseModelChecks
from vibrokit.testing.part_checks import PartChecks, Rng
from vibrokit.testing.report import Check, ConformanceError, Finding, Report, make_all, raise_failures
from vibrokit.testing.spring import SpringChecks

__all__ = [
    "Check",
    "ConformanceError",
    "Finding",
    "Report",
    "check",
    "check_contact_law",
    "check_excitation",
    "check_noise_model",
    "check_spring",
    "contact_law_checks",
    "excitation_checks",
    "noise_model_checks",
    "spring_checks",
]

_KINDS: tuple[type[PartChecks], ...] = (ContactLawChecks, SpringChecks, ExcitationChecks, NoiseModelChecks)  # type: ignore[type-arg]


def check_contact_law(law: ContactLaw | type[ContactLaw], *, rng: Rng = 0) -> Report:
    """Check a contact law.

    Parameters
    ----------
    law : ContactLaw, or a subclass
        Of a class, instances are made with random values out of its parameters' declared ranges. An instance is
        checked as it is, and with those of its parameters that declare a range drawn anew.
    rng : int or numpy.random.Generator, optional
        For the random values and points; by default the same ones every time.

    Returns
    -------
    Report
        What was checked and what was measured.

    Raises
    ------
    ConformanceError
        Something does not hold; the text says all that does not.
    """
    return _checked(ContactLawChecks(law, rng))


def check_spring(spring: Spring | type[Spring], *, rng: Rng = 0) -> Report:
    """Check a spring; arguments, result and errors are those of `check_contact_law`."""
    return _checked(SpringChecks(spring, rng))


def check_excitation(excitation: Excitation | type[Excitation], *, rng: Rng = 0) -> Report:
    """Check an excitation; arguments, result and errors are those of `check_contact_law`."""
    return _checked(ExcitationChecks(excitation, rng))


def check_noise_model(noise: NoiseModel | type[NoiseModel], *, rng: Rng = 0) -> Report:
    """Check a noise model; arguments, result and errors are those of `check_contact_law`."""
    return _checked(NoiseModelChecks(noise, rng))


def contact_law_checks(law: ContactLaw | type[ContactLaw], *, rng: Rng = 0) -> tuple[Check, ...]:
    """Return the single checks of `check_contact_law`, each a pair (name, function that raises ConformanceError)."""
    return ContactLawChecks(law, rng).checks()


def spring_checks(spring: Spring | type[Spring], *, rng: Rng = 0) -> tuple[Check, ...]:
    """Return the single checks of `check_spring`, each a pair (name, function that raises ConformanceError)."""
    return SpringChecks(spring, rng).checks()


def excitation_checks(excitation: Excitation | type[Excitation], *, rng: Rng = 0) -> tuple[Check, ...]:
    """Return the single checks of `check_excitation`, each a pair (name, function that raises ConformanceError)."""
    return ExcitationChecks(excitation, rng).checks()


def noise_model_checks(noise: NoiseModel | type[NoiseModel], *, rng: Rng = 0) -> tuple[Check, ...]:
    """Return the single checks of `check_noise_model`, each a pair (name, function that raises ConformanceError)."""
    return NoiseModelChecks(noise, rng).checks()


def check(name: str, *, rng: Rng = 0) -> Report:
    """Check whatever is registered under a name: a contact law, a spring, an excitation, a noise model, or several.

    Unlike the other functions it does not raise when something does not hold: the report says so.

    Raises
    ------
    UnknownNameError
        No such part is registered.
    """
    known = {kind: {entry.name for entry in names(kind.group)} for kind in _KINDS}
    reports = [_report(kind(load(kind.group, name, kind.kind), rng)) for kind in _KINDS if name in known[kind]]
    if not reports:
        raise UnknownNameError(f"There is no part {name!r} to check{nearest(name, set().union(*known.values()))}")
    return Report(tuple(finding for report in reports for finding in report.findings))


def _report(checks: PartChecks[Part]) -> Report:
    kind = checks.group.noun
    return make_all(f"{checks.cls.__name__}, {'an' if kind[0] == 'e' else 'a'} {kind}", checks.checks())


def _checked(checks: PartChecks) -> Report:  # type: ignore[type-arg]
    return raise_failures(_report(checks))
