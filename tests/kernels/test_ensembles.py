"""Ensembles: paused and continued, at parts of the period, sections kept, and the tests that end a trajectory."""

import functools
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import vibrokit as vk
from tests.scenes import impacting
from vibrokit.kernels import ensemble
from vibrokit.kernels.ensemble import Stop, run_ensemble
from vibrokit.kernels.stopping import COMPLETED, LEFT_BASIN, LEFT_REGION, REACHED
from vibrokit.kernels.streams import streams_of
from vibrokit.symbolic.flow_kind import Flow

# Tests compare one rounding with another, not with the true motion.
pytestmark = pytest.mark.filterwarnings("ignore::vibrokit.kernels.choice.CoarseStepsWarning")
RK = vk.RK4(steps=64)
STEPPERS = [RK, vk.FreeFlight()]
PARTS = 16  # of the period
COUNT = 150  # more than any number of lanes, and no multiple of one
EVERYWHERE = [-np.inf, np.inf]


def scattered(count=COUNT, reach=0.7):
    return np.random.default_rng(5).uniform(-reach, reach, (count, 2))


def noisy(states, streams, budget, **more):
    return run_ensemble(impacting(), Flow.NOISY, RK, states, budget, streams=streams, **more)


@pytest.fixture
def one_block(monkeypatch):
    """All trajectories in one block, whose lanes are refilled."""
    monkeypatch.setattr(ensemble, "_SMALLEST_BLOCK", 4096)


# --- paused and continued


@functools.cache
def whole(budget=10):
    return noisy(scattered(), streams_of(11, np.arange(COUNT)), budget)


class TestPausing:
    def test_goes_on_from_states_and_streams(self):
        ended = noisy(scattered(), streams_of(11, np.arange(COUNT)), 4)
        for budget in (3, 3):
            ended = noisy(ended.states, ended.streams, budget)
        assert ended.states.tobytes() == whole().states.tobytes()
        assert ended.streams.tobytes() == whole().streams.tobytes()
        assert len(np.unique(ended.states[:, 0])) == COUNT

    def test_each_pauses_at_a_time_of_its_own(self):
        first = np.random.default_rng(1).integers(0, 11, COUNT)
        ended = noisy(scattered(), streams_of(11, np.arange(COUNT)), first)
        assert ended.intervals.tolist() == first.tolist()
        ended = noisy(ended.states, ended.streams, 10 - first)
        assert ended.states.tobytes() == whole().states.tobytes()
        assert ended.streams.tobytes() == whole().streams.tobytes()

    def test_those_that_stopped_stay_out(self):
        """The sum of the intervals and the last state are those of a run without pauses."""
        stop = Stop(region=np.array([[-0.52, 0.56], [-0.5, 0.5]]), between=True)
        streams = streams_of(11, np.arange(COUNT))
        states, total, status = scattered(), np.zeros(COUNT, dtype=int), np.zeros(COUNT, dtype=int)
        unpaused = noisy(states, streams, 10, stop=stop)
        left = np.arange(COUNT)
        for budget in (4, 3, 3):
            part = noisy(states[left], streams[left], budget, stop=stop)
            states[left], streams[left], status[left] = part.states, part.streams, part.status
            total[left] += part.intervals
            left = left[part.status == COMPLETED]
        assert states.tobytes() == unpaused.states.tobytes()
        assert streams.tobytes() == unpaused.streams.tobytes()
        assert total.tolist() == unpaused.intervals.tolist()
        assert status.tolist() == unpaused.status.tolist()
        assert len(np.unique(total)) > 5

    def test_any_subset_in_any_order(self):
        chosen = np.random.default_rng(2).permutation(COUNT)[:77]
        half = noisy(scattered(), streams_of(11, np.arange(COUNT)), 4)
        ended = noisy(half.states[chosen], half.streams[chosen], 6)
        assert ended.states.tobytes() == whole().states[chosen].tobytes()
        assert ended.streams.tobytes() == whole().streams[chosen].tobytes()

    def test_in_threads(self, monkeypatch):
        monkeypatch.setattr(ensemble, "_BLOCK", 7)
        monkeypatch.setattr(ensemble, "_SMALLEST_BLOCK", 7)
        with ThreadPoolExecutor(3) as pool:
            ended = noisy(scattered(), streams_of(11, np.arange(COUNT)), 4, executor=pool)
            ended = noisy(ended.states, ended.streams, 6, executor=pool)
        assert ended.states.tobytes() == whole().states.tobytes()

    def test_the_streams_given_are_left_as_they_were(self):
        streams = streams_of(11, np.arange(COUNT))
        noisy(scattered(), streams, 1)
        assert streams.tobytes() == streams_of(11, np.arange(COUNT)).tobytes()


# --- parts of the period


def parts(stepper, states, budget, scene=None, **more):
    scene = scene or impacting()
    return run_ensemble(scene, Flow.STATE, stepper, states, budget, interval=scene.section_interval / PARTS, **more)


@pytest.mark.parametrize("stepper", STEPPERS, ids=lambda stepper: stepper.name)
class TestPartsOfThePeriod:
    def test_free_motion_is_that_of_whole_periods(self, stepper):
        """Damped and linear, so rounding does not grow: below 2e-16 in each of 10 x 64 steps of sums of 10 terms."""
        free = impacting().replace({"barriers.0.position": 9.0, "barriers.1.position": -9.0})
        whole = run_ensemble(free, Flow.STATE, stepper, scattered(), 10)
        ended = parts(stepper, scattered(), 10 * PARTS, free)
        np.testing.assert_allclose(ended.states, whole.states, rtol=0, atol=2e-16 * 10 * 64 * 10)

    def test_with_contacts(self, stepper):
        """One period, over which small errors grow less than a thousandfold; `FreeFlight` has its tolerance besides."""
        whole = run_ensemble(impacting(), Flow.STATE, stepper, scattered(), 1)
        error = 64 * 2e-16 if stepper is RK else 10 * stepper.tolerance
        np.testing.assert_allclose(parts(stepper, scattered(), PARTS).states, whole.states, rtol=0, atol=1e3 * error)

    def test_goes_on_at_whole_periods(self, stepper):
        ended = parts(stepper, parts(stepper, scattered(), PARTS).states, 2 * PARTS)
        assert ended.states.tobytes() == parts(stepper, scattered(), 3 * PARTS).states.tobytes()

    @pytest.mark.parametrize("part", [1 / PARTS, 0.4], ids=["commensurate", "incommensurate"])
    def test_each_as_if_alone(self, stepper, part, one_block):
        budget = np.random.default_rng(3).integers(0, 3 * PARTS, COUNT)
        budget[::3] = PARTS * (np.arange(len(budget[::3])) % 4)
        stop = Stop(region=np.array([[-0.52, 0.58], EVERYWHERE]), between=True, every=2)
        given = {"stop": stop, "interval": part * impacting().section_interval, "start_time": 0.3, "visits": 3}
        together = run_ensemble(impacting(), Flow.STATE, stepper, scattered(), budget, **given)
        assert set(together.status) == {COMPLETED, LEFT_REGION}
        for index in range(0, COUNT, 1 if stepper is RK else 5):
            one = slice(index, index + 1)
            alone = run_ensemble(impacting(), Flow.STATE, stepper, scattered()[one], budget[one], **given)
            for name in ("states", "intervals", "status", "visits"):
                assert getattr(together, name)[one].tobytes() == getattr(alone, name).tobytes()


# --- sections kept


@pytest.mark.parametrize("stepper", STEPPERS, ids=lambda stepper: stepper.name)
class TestVisits:
    def sections(self, stepper, number):
        return impacting().section_map(scattered(20), periods=number, stepper=stepper)

    def test_rows_are_sections(self, stepper):
        ended = run_ensemble(impacting(), Flow.STATE, stepper, scattered(20), 3, visits=5)
        for row in range(3):
            assert ended.visits[:, row].tobytes() == self.sections(stepper, row + 1).tobytes()
        assert not ended.visits[:, 3:].any()

    def test_later_sections_replace_the_earliest(self, stepper):
        ended = run_ensemble(impacting(), Flow.STATE, stepper, scattered(20), 8, visits=3)
        for number in (6, 7, 8):
            assert ended.visits[:, (number - 1) % 3].tobytes() == self.sections(stepper, number).tobytes()

    def test_several_intervals_to_a_section(self, stepper):
        ended = run_ensemble(impacting(), Flow.STATE, stepper, scattered(20), 11, visits=2, keep=3)
        for number in (2, 3):
            assert ended.visits[:, (number - 1) % 2].tobytes() == self.sections(stepper, 3 * number).tobytes()
        assert ended.states.tobytes() == self.sections(stepper, 11).tobytes()


@pytest.mark.parametrize(
    "stepper", [vk.RK4(steps=256), vk.RK8(steps=64), vk.FreeFlight(1e-10)], ids=lambda stepper: stepper.name
)
def test_starts_at_several_phases(stepper):
    """Trajectories that begin at parts of the period end where those of a whole period do."""
    osc, parts = impacting(), 16
    phases = np.arange(COUNT) % parts
    begun = np.array([
        run_ensemble(osc, Flow.STATE, stepper, state[None], phase, interval=osc.section_interval / parts).states[0]
        for state, phase in zip(scattered(40), phases[:40], strict=True)
    ])  # fmt: skip
    ended = run_ensemble(
        osc, Flow.STATE, stepper, begun, 2 * parts - phases[:40], phases=phases[:40], visits=2, keep=parts,
        interval=osc.section_interval / parts,
    )  # fmt: skip
    whole = run_ensemble(osc, Flow.STATE, stepper, scattered(40), 2, visits=2)
    np.testing.assert_allclose(ended.states, whole.states, atol=1e-9)
    np.testing.assert_allclose(ended.visits, whole.visits, atol=1e-9)


def test_visits_of_one_that_stops_end_with_its_last_state():
    ended = noisy(scattered(), streams_of(11, np.arange(COUNT)), 10, stop=Stop(region=np.array([[-0.3, 0.3]] * 2)),
                  visits=10)  # fmt: skip
    last = ended.visits[np.arange(COUNT), ended.intervals - 1]
    assert last.tobytes() == ended.states.tobytes()
    assert not ended.visits[np.arange(10) >= ended.intervals[:, None]].any()


# --- what ends a trajectory, decided by NumPy on the sections that were kept

BUDGET = 12


@functools.cache
def sections():
    """The sections of unhindered trajectories, (COUNT, BUDGET, 2)."""
    ended = noisy(scattered(), streams_of(7, np.arange(COUNT)), BUDGET, visits=BUDGET)
    assert (ended.intervals == BUDGET).all()
    return ended.visits


def stopped(stop):
    return noisy(scattered(), streams_of(7, np.arange(COUNT)), BUDGET, stop=stop)


def first_of(ends):
    """Sections passed until the first at which `ends` holds, or all; and which trajectories met one."""
    return np.where(ends.any(axis=1), ends.argmax(axis=1) + 1, ends.shape[1]), ends.any(axis=1)


def ellipses():
    """Two overlapping ones, turned, of different sizes."""
    points = np.array([[0.40, 0.0], [0.33, -0.05]])
    turn = np.array([[np.cos(0.6), np.sin(0.6)], [-np.sin(0.6), np.cos(0.6)]])
    metrics = np.array([np.diag([1 / 0.15, 1 / 0.06]) @ turn, np.diag([1 / 0.05, 1 / 0.2]) @ turn.T])
    return points, metrics


def test_ellipses():
    points, metrics = ellipses()
    ended = stopped(Stop(points=points, point_labels=np.array([4, 9]), metrics=metrics))
    offsets = sections()[:, :, None] - points
    lengths = np.sqrt((np.einsum("kij,nskj->nski", metrics, offsets) ** 2).sum(axis=-1))
    intervals, reached = first_of((lengths <= 1.0).any(axis=-1))
    assert ended.intervals.tolist() == intervals.tolist()
    assert ended.status.tolist() == np.where(reached, REACHED, COMPLETED).tolist()
    at_end = lengths[np.arange(COUNT), intervals - 1]
    assert ended.label.tolist() == np.where(reached, np.array([4, 9])[at_end.argmin(axis=1)], -1).tolist()
    assert set(ended.label) == {-1, 4, 9}
    assert {4, 9} == set(ended.label[(at_end <= 1.0).all(axis=1)])  # of those in both, each is the nearer of some


@pytest.mark.parametrize("every", [1, 3])
def test_ellipses_are_tested_on_the_section_only(every):
    points, metrics = ellipses()
    ended = stopped(Stop(every=every, points=points[:1], point_labels=np.array([0]), metrics=metrics[:1]))
    inside = np.linalg.norm((sections() - points[0]) @ metrics[0].T, axis=-1) <= 1.0
    inside[:, np.arange(1, BUDGET + 1) % every != 0] = False
    intervals, reached = first_of(inside)
    assert ended.intervals.tolist() == intervals.tolist()
    assert (ended.status == REACHED).tolist() == reached.tolist()
    assert 0 < reached.sum() < COUNT


def test_labels_count_inside_their_area_only():
    """Region unbounded: outside the cells a trajectory goes on. Cells of home and unknown ones do not end it."""
    area = np.array([[0.1, 0.5], [-0.1, 0.1]])
    labels = np.array([[0, 3], [-1, 0], [5, 1], [0, -1]], dtype=np.int16)
    ended = stopped(Stop(area=area, labels=labels, home=1))
    inside = ((area[:, 0] <= sections()) & (sections() <= area[:, 1])).all(axis=-1)
    cells = np.floor((sections() - area[:, 0]) / (area[:, 1] - area[:, 0]) * labels.shape).astype(int)
    met = np.where(inside, labels[tuple(np.where(inside[..., None], cells, 0).transpose(2, 0, 1))], -1)
    intervals, left = first_of((met >= 0) & (met != 1))
    assert ended.intervals.tolist() == intervals.tolist()
    assert ended.status.tolist() == np.where(left, LEFT_BASIN, COMPLETED).tolist()
    assert ended.label.tolist() == np.where(left, met[np.arange(COUNT), intervals - 1], -1).tolist()
    assert set(ended.label) == {-1, 0, 3, 5}


def test_the_grid_bounds_its_trajectories():
    area = np.array([[-0.45, 0.52], [-0.3, 0.3]])
    ended = stopped(Stop().with_cells(area, np.full((2, 2), -1, dtype=np.int16)))
    intervals, left = first_of(((sections() < area[:, 0]) | (sections() > area[:, 1])).any(axis=-1))
    assert ended.intervals.tolist() == intervals.tolist()
    assert ended.status.tolist() == np.where(left, LEFT_REGION, COMPLETED).tolist()
    assert 0 < left.sum() < COUNT


# --- between two tests

TESTS = 64  # in a period of 2 pi
H = 2 * np.pi / TESTS
CUBIC_ERROR = H**4 / 384  # of the cubic that agrees with cos at both ends and in slope; it lies below cos at its top


def swinging():
    """x = A cos(t + phase): undamped, unforced, its stops out of reach."""
    return impacting().replace(
        {"damping_ratio": 0.0, "excitations.0.amplitude": 0.0, "excitations.0.frequency": 1.0,
         "excitations.1.force": 0.0, "barriers.0.position": 9.0, "barriers.1.position": -9.0}
    )  # fmt: skip


def swing(stepper, amplitude, phase, side, budget, between=True):
    """Run with x bounded by 1 on one side, from a phase at or before the turning point there."""
    states = side * np.column_stack([amplitude * np.cos(phase), -amplitude * np.sin(phase)])
    bounds = np.array([[-np.inf, 1.0] if side > 0 else [-1.0, np.inf], EVERYWHERE])
    stop = Stop(region=bounds, between=between)
    return run_ensemble(swinging(), Flow.STATE, stepper, states, budget, stop=stop, interval=H)


@pytest.mark.parametrize("side", [1, -1], ids=["right", "left"])
@pytest.mark.parametrize("stepper", [vk.RK4(steps=64 * TESTS), vk.FreeFlight()], ids=lambda stepper: stepper.name)
class TestBetween:
    """RK4 takes 64 steps in H, so its error is about (H/64)^4 = 6e-12; A is never nearer to 1 than 1e-10."""

    def test_a_turn_just_outside(self, stepper, side):
        """Both tests are inside, by 1 − cos(H/10); the turning point lies between them."""
        phase = -H * np.linspace(0.1, 0.9, 33)
        out = np.full(33, 1.0 + 1.01 * CUBIC_ERROR + 1e-10)
        assert 1.0 - np.cos(0.1 * H) > 2 * CUBIC_ERROR
        assert (swing(stepper, out, phase, side, 1).status == LEFT_REGION).all()
        assert (swing(stepper, out, phase, side, 1, between=False).status == COMPLETED).all()
        assert (swing(stepper, np.full(33, 1.0 - 1e-10), phase, side, 1).status == COMPLETED).all()

    def test_a_whole_period(self, stepper, side):
        """It is stopped exactly if A > 1, by the first test outside or by the first after the turning point."""
        rng = np.random.default_rng(8)
        amplitude, phase = rng.uniform(0.5, 1.5, 100), rng.uniform(-np.pi, -H, 100)
        amplitude[::2] = 1.0 + rng.choice([-1, 1], 50) * rng.uniform(1.1 * CUBIC_ERROR, 1e-4, 50)
        ended = swing(stepper, amplitude, phase, side, TESTS)
        assert (ended.status == LEFT_REGION).tolist() == (amplitude > 1.0).tolist()
        turn = np.ceil(-phase / H)  # the first test after the turning point
        first_outside = np.ceil((-phase - np.arccos(1.0 / np.maximum(amplitude, 1.0))) / H)
        expected = np.where(amplitude > 1.0, np.minimum(np.maximum(first_outside, 1), turn), TESTS)
        assert ended.intervals.tolist() == expected.tolist()
        assert 10 < (amplitude > 1.0).sum() < 90


@pytest.mark.parametrize("flow", [Flow.STATE, Flow.HAMILTONIAN_VARIATIONAL], ids=lambda flow: flow.value)
def test_states_of_another_flow_are_refused(flow):
    """A kernel would read and write beyond them."""
    with pytest.raises(ValueError, match=r"shape \(count, \d+\), got \(3, 5\)"):
        run_ensemble(impacting(), flow, RK, np.zeros((3, 5)))


def test_bounds_hold_in_every_fixed_step():
    """Half a turn of a free oscillator leads beyond the bound and back, at rest both at the start and at the end."""
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.0, noise=vk.WhiteNoise(0.0))
    for start, low, status in ((1.0, -0.9, LEFT_REGION), (1.0, -1.001, COMPLETED), (1.0, -0.99999, LEFT_REGION)):
        ended = run_ensemble(
            osc, Flow.NOISY, RK, np.array([[start, 0.0]]), streams=streams_of(1, np.arange(1)),
            stop=Stop(region=np.array([[low, np.inf], EVERYWHERE]), between=True),
        )  # fmt: skip
        assert ended.status.tolist() == [status]
