"""Findings: what an analysis reports besides its numbers, as data; their sentences are made here and nowhere else."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from enum import StrEnum

from vibrokit.progress import OutOfTime
from vibrokit.results.basins import LEFT

INTERRUPT, TIME_LIMIT = "interrupt", "time limit"  # reasons for which work is stopped
Value = float | int | str | bool | None | Sequence[float] | Sequence[int] | Sequence[str]


class Severity(StrEnum):
    """How much a finding matters."""

    INFO = "info"
    """It explains a number."""
    WARNING = "warning"
    """A number may be less certain, or something less complete, than its user expects."""
    ERROR = "error"
    """Something that was asked for is missing."""


class Code(StrEnum):
    """What can be found. Each code has a severity, a sentence and advice on what to do.

    The sentence is a template of the finding's values; ``{state}`` and ``{goal}`` in it are the finding's source and
    target, by name where names are known.
    """

    severity: Severity
    sentence: str
    advice: str

    def __new__(cls, value: str, severity: Severity, sentence: str, advice: str = "") -> Code:
        member = str.__new__(cls, value)
        member._value_ = value
        member.severity, member.sentence, member.advice = severity, sentence, advice
        return member

    # Any analysis
    REMARK = "remark", Severity.INFO, "{text}", "Read it: a plug-in wrote it."
    STOPPED = (
        "stopped", Severity.ERROR,
        "The work was stopped during {stage} ({reason}); what was found before is kept.",
        "Run it again with more time.",
    )  # fmt: skip
    UNKNOWN_KIND = (
        "unknown-kind", Severity.WARNING,
        "No installed package registers results of kind {kind}; the file is opened as plain data.",
        "Install the package that wrote the file.",
    )  # fmt: skip
    SOURCE_FAILED = (
        "source-failed", Severity.ERROR,
        "{state} could not be analyzed: {reason}",
        "The reason says what to change.",
    )  # fmt: skip
    ANALYZER_NOT_RUN = (
        "analyzer-not-run", Severity.ERROR,
        "The analyzer {analyzer} was not run: {reason}",
        "The reason says what to change.",
    )  # fmt: skip

    # Structure
    STEADY_STATES = "steady-states", Severity.INFO, "Steady states: {count}, from {starts} starts."
    STARTS_DIVERGED = (
        "starts-diverged", Severity.WARNING,
        "{count} of {starts} starts diverged.",
        "Narrow the region, or check the signs of the forces.",
    )  # fmt: skip
    STARTS_UNSETTLED = (
        "starts-unsettled", Severity.WARNING,
        "At least {count} starts settled on no equilibrium and no limit cycle.",
        "Raise the budget.",
    )  # fmt: skip
    SURVIVAL = (
        "survival", Severity.INFO,
        "Starts that had not settled after {periods} periods with {stepper}: {survivors} of {starts}.",
    )  # fmt: skip
    CHAOTIC_TRANSIENT = (
        "chaotic-transient", Severity.INFO,
        "Motion that persists with the coarser steps does not persist with the finer ones: it is a chaotic transient.",
    )  # fmt: skip
    SLOW_SETTLING = (
        "slow-settling", Severity.WARNING,
        "{count} starts still approach an orbit of period above {period}, or one with a multiplier close to 1.",
        "Raise the budget.",
    )  # fmt: skip
    CELLS_UNSETTLED = (
        "cells-unsettled", Severity.WARNING,
        "{fraction:.2%} of the cells did not settle within the budget.",
        "Raise the budget.",
    )  # fmt: skip
    CELLS_LEFT_REGION = (
        "cells-left-region", Severity.INFO,
        "{fraction:.2%} of the cells left the region.",
        "Widen the region if this matters.",
    )  # fmt: skip
    CELLS_NOT_FOLLOWED = (
        "cells-not-followed", Severity.WARNING,
        "{fraction:.2%} of the cells were not followed.",
        "Run it again with more time.",
    )  # fmt: skip
    SADDLES = "saddles", Severity.INFO, "Unstable orbits on basin boundaries: {count}."
    BOUNDARIES_SKIPPED = (
        "boundaries-skipped", Severity.WARNING,
        "{skipped} of {total} basin boundaries, the shortest on the grid, were not followed.",
        "Refine the basin grid on a smaller region.",
    )  # fmt: skip
    MOTIONS_NOT_CONVERGED = (
        "motions-not-converged", Severity.WARNING,
        "{count} motions on the boundary between {state} and {goal} almost repeat, but Newton's method did not "
        "converge to an orbit.",
        "Use a finer stepper.",
    )  # fmt: skip
    CHAOTIC_EDGE = (
        "chaotic-edge", Severity.INFO,
        "The edge state between {state} and {goal} is chaotic: largest Lyapunov exponent {exponent:.3g} ± "
        "{error:.1g} s⁻¹, from {count} motions.",
        "Exit paths are not polished to a chaotic edge state; the graph gives an estimate.",
    )  # fmt: skip
    EDGE_NOT_CONVERGED = (
        "edge-not-converged", Severity.WARNING,
        "Edge tracking between {state} and {goal} did not converge within the budget.",
        "Raise the budget.",
    )  # fmt: skip
    BOUNDARY_LOST = (
        "boundary-lost", Severity.WARNING,
        "No orbit was found on the boundary between {state} and {goal}: edge tracking lost the boundary.",
        "Refine the basin grid.",
    )  # fmt: skip
    LARGE_RESIDUAL = (
        "large-residual", Severity.WARNING,
        "The largest residual of an unstable orbit is {residual:.1e}, above {accepted:g}.",
        "Use a finer stepper.",
    )  # fmt: skip
    SADDLES_OUTSIDE = (
        "saddles-outside", Severity.INFO,
        "{count} of the unstable orbits lie outside the region.",
        "Widen the region to show them.",
    )  # fmt: skip
    NO_MANIFOLDS = (
        "no-manifolds", Severity.WARNING,
        "Saddle {saddle} has no manifolds: {reason}",
        "The reason says what to change.",
    )  # fmt: skip

    # Continuation
    BRANCHES = "branches", Severity.INFO, "{branches} branches of steady states at {values} values of {parameter}."
    BIFURCATION = "bifurcation", Severity.INFO, "{kind} of branch {state} at {value:.8g} ± {error:.1g}."
    BRANCH_ENDS = (
        "branch-ends", Severity.WARNING,
        "Branch {state} {change} between {low:.8g} and {high:.8g}, where {located} was located.",
        "Add values between the two.",
    )  # fmt: skip
    FOUND_BY_NEIGHBOUR = (
        "found-by-neighbour", Severity.INFO,
        "{count} steady states were found from a neighbouring value and not by the search.",
    )  # fmt: skip
    NOTHING_AT = (
        "nothing-at", Severity.WARNING,
        "At {value:g} no steady state was found: {reason}",
        "The reason says what to change.",
    )  # fmt: skip

    # Energies
    AT_EXIT = "at-exit", Severity.INFO, "{state} already satisfies the exit condition: ΔU = 0."
    NOISE_NOT_WEAK = (
        "noise-not-weak", Severity.WARNING,
        "ΔU/D = {ratio:.2g} from {state} to {goal} at D = {intensity:g}, below {least:g}: the noise is not weak, and "
        "exp(ΔU/D) does not describe the mean exit time.",
        "Lower the noise intensity, or simulate exit times directly.",
    )  # fmt: skip
    NO_EXIT_FOUND = (
        "no-exit-found", Severity.ERROR,
        "No exit path from {state} was found.",
        "Raise the budget or the number of points, or widen the region.",
    )  # fmt: skip
    METHOD_FAILED = (
        "method-failed", Severity.WARNING,
        "The {method} could not be used for {state}: {reason}",
        "The reason says what to change.",
    )  # fmt: skip

    # Action plot
    SHOTS = (
        "shots", Severity.INFO,
        "Action plot from {state}: {escaped} of {paths} extremal paths escaped, {left_region} left the region without "
        "an exit, {remaining} remained inside, {diverged} diverged; {branches} distinct exit paths.",
    )  # fmt: skip
    REFINEMENT = (
        "refinement", Severity.INFO,
        "Action plot from {state}: over the last {last} of {rounds} refinement rounds the least action changed by "
        "{change:.1e} (relative).",
        "If the change is above the error you accept, raise rounds or points.",
    )  # fmt: skip
    REFINEMENT_TOO_SHORT = (
        "refinement-too-short", Severity.WARNING,
        "Action plot from {state}: {rounds} refinement rounds are too few to tell how the least action changes.",
        "Raise rounds.",
    )  # fmt: skip

    # Graph
    GRAPH = (
        "graph", Severity.INFO,
        "Graph from {state}: {nodes_x} × {nodes_v} nodes, {steps} steps per period by {stepper}.",
    )  # fmt: skip
    GRAPH_PATH_LOST = (
        "graph-path-lost", Severity.WARNING,
        "The graph's path from {state} to {goal} could not be traced back.",
        "Raise the number of nodes.",
    )  # fmt: skip

    # Polishing
    SADDLE_NOT_USABLE = (
        "saddle-not-usable", Severity.WARNING,
        "Saddle {saddle} on the basin boundary of {state} is {kind}; no path is polished to it.",
        "Use the graph's estimate for this exit.",
    )  # fmt: skip
    SADDLES_OF_OTHERS = (
        "saddles-of-others", Severity.WARNING,
        "No usable orbit on the basin boundary of {state} is known; paths were polished to saddles between other "
        "basins.",
        "Refine the basin grid, so that edge tracking can follow this boundary.",
    )  # fmt: skip
    CANDIDATES_SKIPPED = (
        "candidates-skipped", Severity.INFO,
        "{skipped} of {total} candidate paths from {state} cost more than {factor:g} times the least polished action "
        "and were not polished.",
    )  # fmt: skip
    CANDIDATE_FAILED = (
        "candidate-failed", Severity.INFO,
        "A candidate path of the {finder} from {state} with action {action:.4g} did not converge: {reason}",
    )  # fmt: skip
    NO_CERTIFICATE = (
        "no-certificate", Severity.WARNING,
        "A path from {state} with action {action:.6g} converged but could not be certified: {reason}",
        "Use a finer stepper.",
    )  # fmt: skip
    STARTS_ON_ORBIT = (
        "starts-on-orbit", Severity.WARNING,
        "The path from {state} with action {action:.6g} starts on the orbit itself, {periods:.0f} periods before its "
        "end, because the motion is not linear near the orbit. Its action is an upper bound.",
    )  # fmt: skip
    COMPETING_PATHS = (
        "competing-paths", Severity.INFO,
        "Paths from {state} that cost at most {percent:g} % more than the least action {least:.6g}: {actions}.",
        "At finite noise all of them carry exits.",
    )  # fmt: skip
    FLAT_VALLEY = (
        "flat-valley", Severity.INFO,
        "The stable and unstable manifolds of the best path from {state} meet at a sine of only {sine:.1e}: the action "
        "hardly changes along a family of paths.",
        "At finite noise the whole family carries exits.",
    )  # fmt: skip
    CHAOTIC_SOURCE = (
        "chaotic-source", Severity.INFO,
        "{state} is chaotic: paths were polished from {count} unstable orbits inside it (periods: {periods}).",
        "Its energies are brackets.",
    )  # fmt: skip
    GRAPH_ONLY_SOURCE = (
        "graph-only-source", Severity.INFO,
        "{state} is {kind}: only the graph gives its energies.",
    )  # fmt: skip

    # Agreement of graph and path
    AGREEMENT = (
        "agreement", Severity.INFO,
        "From {state} to {goal} the graph gives {graph:.4g} ± {error:.1g} and the polished path {path:.6g}: they "
        "agree.",
    )  # fmt: skip
    CHEAPER_PATH_EXPECTED = (
        "cheaper-path-expected", Severity.WARNING,
        "From {state} to {goal} the graph gives {graph:.4g} ± {error:.1g}, less than the polished path's {path:.6g}: a "
        "cheaper path probably exists.",
        "Raise the graph's nodes or the action plot's points.",
    )  # fmt: skip
    GRAPH_TOO_COARSE = (
        "graph-too-coarse", Severity.WARNING,
        "From {state} to {goal} the graph gives {graph:.4g} ± {error:.1g} and the polished path {path:.6g}: the graph "
        "is too coarse to exclude a cheaper path.",
        "Raise the graph's nodes.",
    )  # fmt: skip
    NO_POLISHED_PATH = (
        "no-polished-path", Severity.WARNING,
        "From {state} to {goal} only the graph's estimate {graph:.4g} ± {error:.1g} is available; no path was "
        "polished.",
    )  # fmt: skip
    NOT_SEARCHED = (
        "not-searched", Severity.WARNING,
        "From {state} to {goal} the polished path costs {path:.6g}; no graph search tests whether a cheaper "
        "path exists.",
        "Keep the graph search.",
    )  # fmt: skip
    BRACKET = (
        "bracket", Severity.INFO,
        "From {state} to {goal}: at most {path:.6g}, by a path from an orbit inside the set; the graph estimates "
        "{graph:.4g} ± {error:.1g}.",
    )  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Finding:
    """One thing that an analysis found; ``str(finding)`` is its sentence.

    Attributes
    ----------
    code : Code
    source, target : int or None
        Labels of the attractors that it is about: the one left and the one reached, or the two on either side of a
        basin boundary. −1 stands for an exit that is not an attractor, `LEFT` for motion that leaves the region. In a
        continuation the numbers of branches take the place of labels.
    values : dict
        Numbers and short texts by name, as the code's sentence uses them.
    """

    code: Code
    source: int | None = None
    target: int | None = None
    values: Mapping[str, Value] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", dict(self.values))

    @classmethod
    def of(cls, code: Code, source: int | None = None, target: int | None = None, **values: Value) -> Finding:
        """Make a finding from its values."""
        return cls(code, source, target, values)

    @classmethod
    def stopped(cls, stage: str, reason: KeyboardInterrupt, source: int | None = None) -> Finding:
        """Make the finding that a stage was stopped, by the user or by a time limit."""
        word = TIME_LIMIT if isinstance(reason, OutOfTime) else INTERRUPT
        return cls.of(Code.STOPPED, source, stage=stage, reason=word)

    @property
    def severity(self) -> Severity:
        """How much it matters."""
        return self.code.severity

    @property
    def advice(self) -> str:
        """What to do; empty if nothing is needed."""
        return self.code.advice

    def sentence(self, names: Sequence[str] = ()) -> str:
        """Return the sentence, with attractors by name where names are given, in the order of labels."""
        words = {"state": _named(self.source, names), "goal": _named(self.target, names)}
        shown = {name: _listed(value) for name, value in self.values.items()}
        text = self.code.sentence.format(**words, **shown)
        return text[:1].upper() + text[1:]

    def __str__(self) -> str:
        return self.sentence()


def _named(label: int | None, names: Sequence[str]) -> str:
    if label is None or label < 0:
        return "motion that leaves the region" if label == LEFT else "the exit"
    return names[label] if label < len(names) else f"attractor {label}"


def _listed(value: Value) -> Value:
    if isinstance(value, list | tuple):
        return ", ".join(f"{entry:.6g}" if isinstance(entry, float) else str(entry) for entry in value) or "none"
    return value
