"""What `vibrokit trade` measures of basin grids."""

import vibrokit as vk
from vibrokit.trade.basins import measure_basins


def test_every_setting_is_measured_and_finer_steps_leave_no_wrong_cell_on_a_smooth_scene():
    trade = measure_basins(vk.load_scene("duffing"), cells=(40, 40), margins=(2, None))
    steps = [f"RK4(steps={count})" for count in (64, 128, 256, 512)]
    assert [(row.stepper, row.margin) for row in trade.rows] == [(step, m) for step in steps for m in (2, None)]
    assert [(row.stepper, row.margin) for row in trade.rows if row.default] == [("RK4(steps=256)", 2)]
    assert trade.reference == "RK4(steps=1024)"
    assert min(row.seconds for row in trade.rows) > 0
    assert [row.wrong for row in trade.rows if row.stepper == "RK4(steps=512)"] == [0.0, 0.0]
    assert max(row.wrong for row in trade.rows) < 0.01
    assert all(row.shift <= row.wrong for row in trade.rows)
    text = str(trade)
    assert (text.count("← default"), text.count("none")) == (1, 4)
    assert all(row.stepper in text for row in trade.rows)
