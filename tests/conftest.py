import pytest

import vibrokit as vk
from vibrokit import progress


@pytest.fixture(scope="session")
def paper():
    """The paper's scene at ω = 0.570 and its structure."""
    osc = vk.load_scene("hertz-0.570")
    return osc, vk.find_structure(osc, cells=(100, 100))


@pytest.fixture
def clock(monkeypatch):
    """A clock of progress and time limits that tests set."""

    class Clock:
        now = 100.0

        def perf_counter(self):
            return self.now

    clock = Clock()
    monkeypatch.setattr(progress, "time", clock)
    return clock


@pytest.hookimpl(tryfirst=True)  # before tests are chosen by their marks
def pytest_collection_modifyitems(items):
    """Put examples of the manual into a layer, count long tests among the slow ones, and put tutorials first.

    The examples of the reference call each public object; those of other pages compute what other tests show. Workers
    take the last tests from each other, and would run tutorials twice.
    """
    for item in items:
        if isinstance(item, pytest.DoctestItem):
            item.add_marker("slow" if item.path.parent.name == "reference" else "long")
        if item.get_closest_marker("long"):
            item.add_marker("slow")
    items.sort(key=lambda item: item.path.name != "test_tutorials.py")
