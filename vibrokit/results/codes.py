"""Codes of findings: for each what it means, how much it matters, and what to do. All sentences are defined here."""

from __future__ import annotations

from enum import StrEnum
from typing import Self


class Sentenced(StrEnum):
    """Codes, each with a sentence, which may be a template of the values that go with it."""

    sentence: str

    def __new__(cls, value: str, sentence: str) -> Self:
        member = str.__new__(cls, value)
        member._value_ = value
        member.sentence = sentence
        return member


class Severity(StrEnum):
    """How much a finding matters."""

    INFO = "info"
    """It explains a number."""
    WARNING = "warning"
    """A number may be less certain, or something less complete, than its user expects."""
    ERROR = "error"
    """Something that was asked for is missing."""


INFO, WARNING, ERROR = Severity
_SEE_REASON = "Change the setting that the reason names."
_RAISE_BUDGET = "Raise budget, an argument of find_structure."
_FINER_STEPPER = "Use a finer stepper."


class Code(StrEnum):
    """What can be found. Each code has a severity, a sentence and advice on what to do.

    The sentence is a template of the finding's values; ``{state}`` and ``{goal}`` in it are the finding's source and
    target, by name where names are known. ``{count:start}`` is a number with its noun.
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
    REMARK = "remark", INFO, "{text}", "Read it: a plug-in wrote it."
    STOPPED = (
        "stopped", ERROR, "The work was stopped during {stage} ({reason}); earlier results are kept.",
        "Run it again with more time.",
    )  # fmt: skip
    UNKNOWN_KIND = (
        "unknown-kind", WARNING,
        "No installed package registers results of kind {kind}; the file is opened as plain data.",
        "Install the package that wrote the file.",
    )  # fmt: skip
    SOURCE_FAILED = "source-failed", ERROR, "{state} could not be analyzed: {reason}", _SEE_REASON
    ANALYZER_NOT_RUN = "analyzer-not-run", ERROR, "The analyzer {analyzer} was not run: {reason}", _SEE_REASON

    # Structure
    STEADY_STATES = "steady-states", INFO, "Steady states: {count}, from {starts:start}."
    SEARCH_STOPPED = (
        "search-stopped", ERROR,
        "The search for steady states was stopped after {periods:period} of its {starts:start}: {settled} had "
        "settled, {moving} were still moving in the region, {left} were outside it, and {diverged} had diverged.",
        "Run it again with more time, or with fewer starts.",
    )  # fmt: skip
    SHIFTED_COPIES = (
        "shifted-copies", INFO,
        "A shift by {shift:.6g} m along x leaves the motion unchanged. Of attractors that differ by such shifts, those "
        "in the region are kept; motion that ends at a copy elsewhere is counted apart.",
        "Give a wider region to keep more of them.",
    )  # fmt: skip
    ON_CIRCLE = (
        "on-circle", INFO,
        "A shift by {shift:.6g} m along x leaves the motion unchanged, and some motion turns over and over: x is taken "
        "modulo that, and states that far apart count as one.",
        "Give a region wider than that to tell them apart.",
    )  # fmt: skip
    STARTS_DIVERGED = (
        "starts-diverged", WARNING, "{count} of {starts:start} diverged.",
        "Narrow the region, or check the signs of the forces.",
    )  # fmt: skip
    STARTS_ENDED = "starts-ended", INFO, "{count} of {starts} starts ended where the forces do ({where}), or diverged."
    STARTS_NEUTRAL = (
        "starts-neutral", WARNING,
        "{count} of {starts:start} settled on one of a family of equal motions. No force leads back to one of them, so "
        "that none is an attractor.",
        "Give the scene a spring, or a force that presses the mass to a stop.",
    )  # fmt: skip
    STARTS_STALLED = (
        "starts-stalled", WARNING,
        "{count} of {starts:start} were not followed to their end, because they need too many steps in a section "
        "interval.", "Take softer laws, or friction that is smoother; `Oscillator.trajectory` names the force.",
    )  # fmt: skip
    STARTS_UNSETTLED = (
        "starts-unsettled", WARNING, "{count:start} did not settle on an equilibrium or a limit cycle.",
        _RAISE_BUDGET,
    )  # fmt: skip
    SURVIVAL = (
        "survival", INFO,
        "Starts that had not settled after {periods:period} with {stepper}: {survivors} of {starts}.",
    )  # fmt: skip
    CHAOTIC_TRANSIENT = (
        "chaotic-transient", INFO,
        "Motion that persists with the coarser steps does not persist with the finer ones: it is a chaotic transient.",
    )  # fmt: skip
    SLOW_SETTLING = (
        "slow-settling", WARNING,
        "Starts that still approach an orbit of period above {period}, or one with a multiplier close to 1: {count}.",
        _RAISE_BUDGET,
    )  # fmt: skip
    FOLLOWED_ON = (
        "followed-on", INFO,
        "Motions from cells without an attractor that were followed on: {followed}. Of these, {diverged} left for "
        "good, {settled} ended at known steady states or copies of them, and {moving} had not settled.",
    )  # fmt: skip
    REGION_TOO_SMALL = (
        "region-too-small", WARNING,
        "Steady states outside the region: {count}; {x_min:.6g} to {x_max:.6g} m and {v_min:.6g} to {v_max:.6g} m/s "
        "contain all that are known.",
        "Give that region, or none, so that the default is widened.",
    )  # fmt: skip
    TOPS_OUTSIDE = (
        "tops-outside", INFO,
        "The region does not contain the top of a potential barrier at {place:.6g} m, beyond which motion leaves for "
        "other states or for good.",
        "Give a region that contains it if such exits matter.",
    )  # fmt: skip
    CELLS_UNSETTLED = (
        "cells-unsettled", WARNING, "{fraction:.2%} of the cells did not settle within the budget.", _RAISE_BUDGET,
    )  # fmt: skip
    CELLS_LEFT_REGION = (
        "cells-left-region", INFO, "{fraction:.2%} of the cells escaped from the region.",
        "Widen the region if this matters.",
    )  # fmt: skip
    CELLS_AT_COPIES = (
        "cells-at-copies", INFO, "{fraction:.2%} of the cells lead to copies of steady states, whole turns away.",
        "Give a wider region to tell the copies apart.",
    )  # fmt: skip
    CELLS_NOT_FOLLOWED = (
        "cells-not-followed", WARNING, "{fraction:.2%} of the cells were not followed.", "Run it again with more time.",
    )  # fmt: skip
    COARSE_GRID = (
        "coarse-grid", INFO,
        "The basins have {nx} × {nv} cells: transients are long, and a finer grid would take some {sections:.1e} "
        "section-map iterations.",
        "Set cells, an argument of find_structure, for a finer grid.",
    )  # fmt: skip
    GRID_REFINED = (
        "grid-refined", INFO,
        "The basins have {nx} × {nv} cells: on a coarser grid an attractor lay in a cell of another basin.",
        "Set cells, an argument of find_structure, for a finer grid.",
    )  # fmt: skip
    ATTRACTOR_LOST = (
        "attractor-lost", WARNING, "{state} lies in a cell of another basin on {nx} × {nv} cells.",
        "Find the structure on a smaller region around it.",
    )  # fmt: skip
    SADDLES = "saddles", INFO, "Unstable orbits on basin boundaries: {count}."
    BOUNDARIES_SKIPPED = (
        "boundaries-skipped", WARNING,
        "{skipped} of {total} basin boundaries, the shortest on the grid, were not followed.",
        "Refine the basin grid on a smaller region.",
    )  # fmt: skip
    MOTIONS_NOT_CONVERGED = (
        "motions-not-converged", WARNING,
        "Motions on the boundary between {state} and {goal} that almost repeat, but from which Newton's method did not "
        "converge to an orbit: {count}.", _FINER_STEPPER,
    )  # fmt: skip
    CHAOTIC_EDGE = (
        "chaotic-edge", INFO,
        "The edge state between {state} and {goal} is chaotic: largest Lyapunov exponent {exponent:.3g} ± {error:.1g} "
        "s⁻¹, from {count:motion}. Unstable orbits found inside it: {orbits}.",
        "Exit paths are polished to these orbits; without one the graph gives an estimate.",
    )  # fmt: skip
    EDGE_NOT_CONVERGED = (
        "edge-not-converged", WARNING, "Edge tracking between {state} and {goal} did not converge within the budget.",
        _RAISE_BUDGET,
    )  # fmt: skip
    BOUNDARY_LOST = (
        "boundary-lost", WARNING,
        "No orbit was found on the boundary between {state} and {goal}: edge tracking lost the boundary.",
        "Refine the basin grid.",
    )  # fmt: skip
    EDGE_BUDGET = (
        "edge-budget", WARNING,
        "Basin boundaries that were not followed to a saddle, because classifying states next to them takes more than "
        "{budget:.1e} section-map iterations: {count}.",
        "Set edge_budget, an argument of find_structure, to more, or search on a smaller region.",
    )  # fmt: skip
    LARGE_RESIDUAL = (
        "large-residual", WARNING,
        "The largest residual of an unstable orbit, divided by the growth by its multipliers, is {residual:.1e}, above "
        "{accepted:g}.",
        _FINER_STEPPER,
    )  # fmt: skip
    SADDLES_OUTSIDE = (
        "saddles-outside", INFO, "Unstable orbits outside the region: {count}.",
        "Widen the region to show them.",
    )  # fmt: skip
    NO_MANIFOLDS = "no-manifolds", WARNING, "Saddle {saddle} has no manifolds: {reason}", _SEE_REASON

    # Continuation
    BRANCHES = "branches", INFO, "{branches:branch/branches} of steady states at {values:value} of {parameter}."
    BIFURCATION = "bifurcation", INFO, "{kind} of branch {state} at {value:.8g} ± {error:.1g}."
    BRANCH_ENDS = (
        "branch-ends", WARNING,
        "Branch {state} {change} between {low:.8g} and {high:.8g}, where {located} was located.",
        "Add values between the two.",
    )  # fmt: skip
    FOUND_BY_NEIGHBOUR = (
        "found-by-neighbour", INFO, "Steady states found from a neighbouring value and not by the search: {count}.",
    )  # fmt: skip
    ENERGY_BRANCHES = "energy-branches", INFO, "Exit paths followed over {values:value} of {parameter}: {branches}."
    PATH_LOST = (
        "path-lost", INFO, "The exit path {state} could not be followed from {parameter} = {value:.8g} to {next:.8g}: "
        "{reason}", "The path folds, grazes a stop or meets another path; pass a value beyond in search=.",
    )  # fmt: skip
    LEAST_PATH_CHANGES = (
        "least-path-changes", INFO,
        "Below {parameter} = {value:.8g} the path {state} has the least action, and above it the path {goal}.",
    )  # fmt: skip
    OTHER_STATES = (
        "other-states", WARNING,
        "At {parameter} = {at} other states coexist than where exits were searched for: ΔU there is that of paths "
        "found elsewhere, and a cheaper one may exist.", "Pass these values, or one of each kind, in search=.",
    )  # fmt: skip
    NOTHING_AT = "nothing-at", WARNING, "At {value:g} nothing was found: {reason}", _SEE_REASON

    # Energies
    AT_EXIT = "at-exit", INFO, "{state} already satisfies the exit condition: ΔU = 0."
    NOISE_NOT_WEAK = (
        "noise-not-weak", WARNING,
        "ΔU/D = {ratio:.2g} from {state} to {goal} at D = {intensity:g}, below {least:g}: the noise is not weak, and "
        "exp(ΔU/D) does not describe the mean exit time.",
        "Lower the noise intensity, or look at the exit times of MFET.",
    )  # fmt: skip
    NO_EXIT_FOUND = (
        "no-exit-found", ERROR, "No exit path from {state} was found.",
        "Raise the action plot's budget or points, or find the structure on a wider region.",
    )  # fmt: skip
    METHOD_FAILED = "method-failed", WARNING, "The {method} could not be used for {state}: {reason}", _SEE_REASON

    NOTHING_PROPOSED = "nothing-proposed", INFO, "The {method} proposed no exit path from {state}."

    # Action plot
    SHOTS = (
        "shots", INFO,
        "Action plot from {state}: {escaped} of {paths:path} reached the exit, {left_region} left the region without "
        "an exit, {remaining} remained inside, {diverged} diverged; {branches:distinct exit path}.",
    )  # fmt: skip
    SHOTS_UNFINISHED = (
        "shots-unfinished", INFO,
        "Action plot from {state}: {count} of {paths:path} were not followed to their end, because they need too many "
        "steps, or graze a stop whose force jumps.",
    )  # fmt: skip
    REFINEMENT = (
        "refinement", INFO,
        "Action plot from {state}: over the last {last} of {rounds:refinement round} the least action changed by "
        "{change:.1e} (relative).", "If the change is above the error you accept, raise rounds or points.",
    )  # fmt: skip
    REFINEMENT_TOO_SHORT = (
        "refinement-too-short", WARNING,
        "Action plot from {state}: too few refinement rounds ({rounds}) to tell how the least action changes.",
        "Raise rounds.",
    )  # fmt: skip

    # Graph
    GRAPH = "graph", INFO, "Graph from {state}: {nodes_x} × {nodes_v} nodes, {steps:step} per period by {stepper}."
    GRAPH_MEMORY = (
        "graph-memory", INFO,
        "Graph from {state}: {memory:g} GiB of memory allow {nodes_x} × {nodes_v} nodes instead of "
        "{wanted_x} × {wanted_v}.", "Raise max_memory_gib.",
    )  # fmt: skip
    GRAPH_PATH_LOST = (
        "graph-path-lost", WARNING, "The graph's path from {state} to {goal} could not be traced back.",
        "Raise the number of nodes.",
    )  # fmt: skip
    GRAPH_NOT_CONVERGED = (
        "graph-not-converged", WARNING,
        "The graph's potential around {state} had not converged when its sweeps ended: more of them may change it by "
        "{part:.1%}.", "Where damping is weak, use the polished path; the graph's error includes this part.",
    )  # fmt: skip

    # Exit times
    CHECKPOINT_NOT_WRITTEN = (
        "checkpoint-not-written", WARNING, "The checkpoint {path} could not be written: {reason}",
        "Free some space, or choose another place.",
    )  # fmt: skip
    INTENSITY_FAILED = (
        "intensity-failed", WARNING, "{state} could not be analyzed at D = {intensity:g}: {reason}", _SEE_REASON,
    )  # fmt: skip
    NO_EXIT_SEEN = (
        "no-exit-seen", WARNING,
        "No walker left {state} at D = {intensity:g}: with 95 % confidence the mean exit time is above {time:.3g} s.",
        "Give more time, raise the noise intensity, or use splitting=True.",
    )  # fmt: skip
    NOT_METASTABLE = (
        "not-metastable", WARNING,
        "{state} is left after {ratio:.2g} relaxation times on average at D = {intensity:g}, below {least:g}: it "
        "is not metastable.", "Lower the noise intensity.",
    )  # fmt: skip
    CORE_EXCEEDS_BASIN = (
        "core-exceeds-basin", WARNING,
        "Only {share:.0%} of the core that noise makes around {state} at D = {intensity:g} lies in its basin: it is no "
        "state of its own there, and has no rates.", "Lower the noise intensity.",
    )  # fmt: skip
    TARGET_EXCEEDS_BASIN = (
        "target-exceeds-basin", WARNING,
        "Only {share:.0%} of the core that noise makes around {goal} at D = {intensity:g} lies in its basin: exits "
        "from {state} do not count as having reached it.", "Lower the noise intensity.",
    )  # fmt: skip
    TARGET_NOT_METASTABLE = (
        "target-not-metastable", WARNING,
        "Only {share:.0%} of the walkers started on {goal} are still there after five relaxation times at "
        "D = {intensity:g}: exits from {state} to it are not permanent.", "Lower the noise intensity.",
    )  # fmt: skip
    NOT_EXPONENTIAL = (
        "not-exponential", WARNING,
        "The exit times of {state} at D = {intensity:g} are not exponential (p = {p_value:.1e}): one rate does not "
        "describe them.", "Look at their distribution with plot_exit_times.",
    )  # fmt: skip
    STEPS_CHANGE_RATE = (
        "steps-change-rate", WARNING,
        "Steps twice as long change ln of the exit rate of {state} at D = {intensity:g} by {change:.2g} ± {error:.1g}: "
        "the steps are too long.", _FINER_STEPPER,
    )  # fmt: skip
    NO_EXCURSION_LEFT = (
        "no-excursion-left", WARNING,
        "No excursion of {replicas:replica} left {state} at D = {intensity:g}: splitting gives no rate.",
        "Raise the noise intensity, or raise replicas.",
    )  # fmt: skip
    SPLITTING_NOT_CONVERGED = (
        "splitting-not-converged", WARNING,
        "The rate of {state} at D = {intensity:g} has an error of {error:.0%} after {replicas:replica}; {wanted:.0%} "
        "was wanted.", "Raise replicas, or expect an error of that size.",
    )  # fmt: skip
    ARRHENIUS_NOT_REACHED = (
        "arrhenius-not-reached", WARNING,
        "From {state} to {goal} the slope d ln τ/d(1/D) changes from {first:.3g} to {last:.3g} m² s⁻³ over the noise "
        "intensities: it is not yet the activation energy.", "Lower the noise intensities.",
    )  # fmt: skip

    # Reconciliation
    USED_INCOMPLETE = (
        "used-incomplete", INFO, "The result of {method} is incomplete; its available part was used.",
        "Run the analyzer to its end.",
    )  # fmt: skip

    # Density
    DENSITY_NOT_CONVERGED = (
        "density-not-converged", WARNING,
        "The density of {state} at D = {intensity:g} had not converged after {intervals:section interval}: ln rate "
        "still changes by about {change:.1e}.", "Expect an error of that size, or raise the noise intensity.",
    )  # fmt: skip
    DENSITY_AT_EDGE = (
        "density-at-edge", WARNING,
        "At D = {intensity:g}, {share:.1e} of the probability of {state} is at the edge of the region, so that exits "
        "beyond it may be missing.", "Find the structure on a wider region.",
    )  # fmt: skip
    MASS_NOT_KEPT = (
        "mass-not-kept", WARNING,
        "At t = {time:.4g} s the probability on the nodes is {mass:.4g}; the rest has left the region.",
        "Widen the region.",
    )  # fmt: skip
    DENSITY_TRUNCATED = (
        "density-truncated", WARNING,
        "Until t = {time:.4g} s truncation errors changed the probability by {change:+.1%}, which was divided out.",
        "Raise the number of nodes: the density is narrow compared with their spacing.",
    )  # fmt: skip
    RATE_UNCERTAIN = (
        "rate-uncertain", WARNING,
        "ln of the rate from {state} to {goal} at D = {intensity:g} has an error of about {error:.2g}, above "
        "{accepted:g}.", "Raise the number of nodes or of steps, or the noise intensity.",
    )  # fmt: skip
    ENERGY_NEEDS_RATES = (
        "energy-needs-rates", INFO,
        "The rate from {state} to {goal} is known at {known} of the noise intensities; an activation energy needs two.",
        "Give several intensities.",
    )  # fmt: skip
    RATE_UNKNOWN = (
        "rate-unknown", WARNING,
        "The rate from {state} to {goal} at D = {intensity:g} is not known: the outflow did not become steady or is "
        "below the numerical errors.", "Raise the number of nodes or of steps, or the noise intensity.",
    )  # fmt: skip

    # Polishing
    SADDLE_NOT_USABLE = (
        "saddle-not-usable", WARNING,
        "Saddle {saddle} on the basin boundary of {state} is {kind}; no path is polished to it.",
        "Use the graph's estimate for this exit.",
    )  # fmt: skip
    CHAOTIC_BOUNDARY = (
        "chaotic-boundary", INFO,
        "The basin boundary of {state} contains a chaotic set. Paths are sought to unstable orbits inside it, which "
        "are saddles {saddles}; their actions are upper bounds.",
    )  # fmt: skip
    SADDLES_OF_OTHERS = (
        "saddles-of-others", WARNING,
        "On the basin boundary of {state} no usable saddle is known that lies outside chaotic sets; paths are "
        "sought to saddles between other basins.",
        "Refine the basin grid, so that edge tracking can follow this boundary.",
    )  # fmt: skip
    CANDIDATES_SKIPPED = (
        "candidates-skipped", INFO,
        "{skipped} of {total} candidate paths from {state} cost more than {factor:g} times the least known path to the "
        "same exit and were not polished.",
    )  # fmt: skip
    CANDIDATE_FAILED = (
        "candidate-failed", INFO,
        "A candidate path of the {finder} from {state} with action {action:.4g} did not converge: {reason}",
    )  # fmt: skip
    NO_CERTIFICATE = (
        "no-certificate", WARNING,
        "A path from {state} with action {action:.6g} converged but could not be certified: {reason}",
        _FINER_STEPPER,
    )  # fmt: skip
    STARTS_ON_ORBIT = (
        "starts-on-orbit", WARNING,
        "The path from {state} with action {action:.6g} starts on the orbit itself, {periods:.0f} periods before its "
        "end, because linearization fails near the orbit. Its action is an upper bound.",
    )  # fmt: skip
    PASSES_ORBITS = (
        "passes-orbits", INFO,
        "The path from {state} to {goal} with action {action:.6g} passes {through}: its action is the sum over the "
        "paths between these.", "Where it passes an attractor, exits lead to that attractor first.",
    )  # fmt: skip
    ONE_SADDLE_TO_SEVERAL = (
        "one-saddle-to-several", INFO,
        "Motion from saddle {saddle} leads to {goals}: exits from {state} over this saddle have one energy.",
        "Which of these attractors is reached depends on the noise near the saddle; MFET counts the exits to each.",
    )  # fmt: skip
    COMPETING_PATHS = (
        "competing-paths", INFO,
        "Paths from {state} that cost at most {percent:g} % more than the least action {least:.6g}: {actions}.",
        "At finite noise all of them carry exits.",
    )  # fmt: skip
    FLAT_VALLEY = (
        "flat-valley", INFO,
        "On the cheapest path from {state}, the unstable manifold of its start and the stable manifold of its end meet "
        "at an angle with a sine of only {sine:.1e}: the action hardly changes along a family of paths.",
        "At finite noise the whole family carries exits.",
    )  # fmt: skip
    CHAOTIC_SOURCE = (
        "chaotic-source", INFO,
        "{state} is chaotic: paths are sought from {count:unstable orbit} inside it (periods: {periods}).",
        "Its energies are brackets.",
    )  # fmt: skip
    GRAPH_ONLY_SOURCE = "graph-only-source", INFO, "{state} is {kind}: only the graph gives its energies."

    # Agreement of graph and path
    AGREEMENT = (
        "agreement", INFO,
        "From {state} to {goal} the graph gives {graph:.4g} ± {error:.1g} and the polished path {path:.6g}: they "
        "agree.",
    )  # fmt: skip
    CHEAPER_PATH_EXPECTED = (
        "cheaper-path-expected", WARNING,
        "From {state} to {goal} the graph gives {graph:.4g} ± {error:.1g}, less than the polished path's {path:.6g}: a "
        "cheaper path probably exists.", "Raise the graph's nodes or the action plot's points.",
    )  # fmt: skip
    GRAPH_TOO_COARSE = (
        "graph-too-coarse", WARNING,
        "From {state} to {goal} the graph gives {graph:.4g} ± {error:.1g} and the polished path {path:.6g}: the graph "
        "is too coarse to exclude a cheaper path.", "Raise the graph's nodes.",
    )  # fmt: skip
    NO_POLISHED_PATH = (
        "no-polished-path", WARNING,
        "From {state} to {goal} only the graph's estimate {graph:.4g} ± {error:.1g} is available; no path was "
        "polished.",
    )  # fmt: skip
    NOT_POLISHED = (
        "not-polished", WARNING,
        "From {state} to {goal} the path of the action plot costs {shot:.4g}; it was not polished.",
    )  # fmt: skip
    MIRROR_IMAGE = (
        "mirror-image", INFO,
        "The path from {state} to {goal} with action {path:.6g} is the mirror image of one that leaves another "
        "attractor; both have the same bounds.",
    )  # fmt: skip
    DETAILED_BALANCE = (
        "detailed-balance", INFO,
        "Detailed balance holds: no path from {state} to {goal} costs less than {least:.10g}, which follows from the "
        "potential energy of the barrier. The polished path costs {path:.10g}.",
    )  # fmt: skip
    BARRIER_ENERGY = (
        "barrier-energy", INFO,
        "Detailed balance holds: leaving {state} for {goal} costs {least:.10g}, which follows from the potential "
        "energy of the barrier. No polished path attains it.",
    )  # fmt: skip
    NOT_SEARCHED = (
        "not-searched", WARNING,
        "From {state} to {goal} the polished path costs {path:.6g}; no graph search tests whether a cheaper path "
        "exists.", "Expect that one may exist; where the noise has no states of its own, a graph search excludes it.",
    )  # fmt: skip
    BRACKET = (
        "bracket", INFO,
        "From {state} to {goal}: at most {path:.6g}, by a path that begins or ends in a chaotic set; the graph gives "
        "{graph:.4g} ± {error:.1g}.",
    )  # fmt: skip
