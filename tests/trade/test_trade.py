"""What `vibrokit trade` measures of steppers: known orders, steppers that cannot be used, table and figure."""

import numpy as np
import pytest

import vibrokit as vk
from vibrokit.cli import main
from vibrokit.plots.trade import work_precision
from vibrokit.scene_file import load_scene
from vibrokit.trade.reference import reference_map
from vibrokit.trade.steppers import measure_steppers, starts_between_stops

SETTINGS = {"starts": 8, "periods": 1, "seconds": 0.01}
LADDERS = (
    tuple(vk.RK4(steps) for steps in (32, 64, 128, 256)),
    tuple(vk.RK8(steps) for steps in (8, 16, 32)),
    tuple(vk.Order8(10.0**-k) for k in (5, 7, 9)),
    tuple(vk.FreeFlight(10.0**-k) for k in (5, 7, 9)),
)


@pytest.fixture(scope="module")
def linear():
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.05, excitations=(vk.Harmonic(0.2, 0.8),))
    return measure_steppers(osc, ladders=LADDERS, **SETTINGS)


def test_orders_without_contact(linear):
    assert linear.orders["RK4"] == pytest.approx(4, abs=0.3)
    assert linear.orders["RK8"] == pytest.approx(8, abs=0.5)
    for name in ("RK4", "RK8", "Order8"):
        errors = [row.error_median for row in linear.rows if row.name == name]
        assert errors == sorted(set(errors), reverse=True)
    # FreeFlight is exact without contact, whatever its tolerance.
    assert max(row.error_90 for row in linear.rows if row.name == "FreeFlight") < 1e-13
    assert linear.checked < 1e-12


def test_numbers_are_complete(linear):
    assert [row.stepper for row in linear.rows] == [repr(stepper) for ladder in LADDERS for stepper in ladder]
    for row in linear.rows:
        assert row.error_median <= row.error_90
        assert min(row.seconds, row.seconds_alone) > 0
    assert [row.stepper for row in linear.rows if row.default] == ["RK4(steps=256)"]
    assert set(linear.references) == {"RK4", "RK8", "Order8", "FreeFlight"}
    assert linear.references["FreeFlight"].startswith("Order8")
    text = str(linear)
    assert all(row.stepper in text for row in linear.rows)
    assert text.count("← default") == 1
    assert "against FreeFlight" in text
    assert "DOP853" in text


def test_figure(linear):
    artists = work_precision(linear.rows)
    axes = artists.ax
    assert axes.get_xscale() == axes.get_yscale() == "log"
    labels = axes.get_legend_handles_labels()[1]
    assert {"RK4, ensemble", "RK4, alone", "default: RK4(steps=256)"} <= set(labels)


def test_refusal_is_told():
    trade = measure_steppers(load_scene("duffing"), ladders=LADDERS, **SETTINGS)
    assert list(trade.unused) == ["FreeFlight"]
    assert "FreeFlight: not used. FreeFlight needs linear motion" in str(trade)
    assert trade.references == {"RK4": "Order8 at 1e-14", **dict.fromkeys(("RK8", "Order8"), "DOP853 at 2.3e-14")}


def test_settings_with_which_trajectories_diverge_are_told():
    """Steps of an eighth of a period are many times as long as a contact with this stop."""
    osc = load_scene("hertz-0.570").replace({"barriers.0.law.stiffness": 1e6})
    trade = measure_steppers(osc, ladders=((vk.RK4(8), vk.RK4(2048)),), **SETTINGS)
    assert [row.stepper for row in trade.rows] == ["RK4(steps=2048)"]
    assert list(trade.unused) == ["RK4(steps=8)"]
    assert "RK4(steps=8): not used." in str(trade)


def test_progress_reaches_its_total():
    updates = []
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.05)
    measure_steppers(osc, ladders=((vk.RK4(64), vk.RK4(128)),), progress=updates.append, **SETTINGS)
    seen = [(update.done, update.total) for update in updates if update.stage == "steppers" and not update.compiling]
    assert list(dict.fromkeys(seen)) == [(0, None), (1, 3), (2, 3), (3, 3)]


@pytest.mark.parametrize("places", [(), (0.5,), (-0.5,), (0.0,)])
def test_starts(places):
    stops = [vk.Barrier(vk.Hertz(50.0), place, "right") for place in places]
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.0, barriers=stops, noise=vk.WhiteNoise(1e-3))
    states = starts_between_stops(osc, 50, np.random.default_rng(0))
    assert states.shape == (50, 2)
    assert all((states[:, 0] <= place).all() for place in places)


def test_reference_crosses_contacts():
    """No damping: half turns of length π/3 in the stop and π left of it, in turns, until time 2π."""
    stop = vk.Barrier(vk.Linear(8.0), 0.0, "right")
    osc = vk.Oscillator(natural_frequency=1.0, damping_ratio=0.0, barriers=(stop,))
    (end,) = reference_map(osc, np.array([[0.0, 1.0]]))
    np.testing.assert_allclose(end, [-np.sin(np.pi / 3), -np.cos(np.pi / 3)], atol=1e-11)


@pytest.fixture
def command(linear, tmp_path, monkeypatch):
    """Arguments of the command, with a small table of steppers in place of the long one, and short basins."""
    monkeypatch.setattr("vibrokit.cli.toolkit.measure_steppers", lambda osc: linear)
    monkeypatch.setattr("vibrokit.cli.toolkit.measure_basins", lambda osc: "basins")
    return ["-o", str(tmp_path / "trade.png")]


def test_command(linear, command, tmp_path, monkeypatch, capsys):
    asked = []
    names = ("measure_energies", "measure_densities", "measure_exit_times", "measure_assessments")
    for name in names:
        monkeypatch.setattr(f"vibrokit.cli.toolkit.{name}", lambda osc, source, name=name: asked.append(source) or name)
    assert main(["trade", "double-well", "--source", "left-rest", *command]) == 0
    printed = capsys.readouterr().out
    assert str(linear) in printed
    assert all(f"\n{name}\n" in printed for name in ("basins", *names))
    assert asked == ["left-rest"] * len(names)
    assert (tmp_path / "trade.png").read_bytes().startswith(b"\x89PNG")


def test_the_command_says_why_there_is_no_table(command, tmp_path, capsys):
    scene = tmp_path / "quiet.toml"
    scene.write_text("natural_frequency = 1.0\ndamping_ratio = 0.05\n")
    assert main(["trade", str(scene), *command]) == 0
    assert "vibrokit: the scene has no noise" in capsys.readouterr().err
