"""Time limits and signals on hard scenes: how long does a call go on after it was told to stop, and what is left?

Each case runs in a process of its own, with a time limit. Between two looks at the limit the calling thread cannot be
stopped. The longest such gap and the work after the limit are measured in processor seconds, so that they are the same
on a busy machine. With ``--signal`` the command line runs in place of the calls, without a limit, and the signal comes
at a random moment; ``interrupts.py`` compares what is printed and saved then. Usage:

    python tests/benchmarks/limits.py [call] [scene] [--seconds 2 10 25] [--signal INT or TERM] [--seed 0]
"""

import argparse
import collections
import dataclasses
import faulthandler
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
import traceback
from pathlib import Path

import vibrokit as vk
from vibrokit import progress

OVER, GAP = 2.0, 1.0  # processor seconds: allowed after a limit, and between two looks at it
_BUSY = 0.3  # of them, from which on it is noted what is done
_HOPELESS = 300.0  # s after the limit, at which it is ended, and says what its threads do
_SECOND = os.sysconf("SC_CLK_TCK")
_NOISE = vk.WhiteNoise(intensity=1e-4)


def scene(**more):
    return vk.Oscillator(**{"natural_frequency": 1.0, "damping_ratio": 0.0, "noise": _NOISE} | more)


def table():
    """A ball on a table, Phys. Rev. E 79, 026206."""
    law = vk.CustomLaw("k*depth + c*rate", k=1e8, c=1487.1)
    forces = vk.Constant(force=-1.0), vk.Harmonic(amplitude=0.7821, frequency=1.0)
    return scene(spring=vk.LinearSpring(0.0), barriers=(vk.Barrier(law, 0.0, "left"),), excitations=forces)


def running():
    """A pendulum that turns over."""
    forces = vk.Constant(force=1.878), vk.Harmonic(amplitude=10.198, frequency=1.0)
    return scene(damping_ratio=0.1, spring=vk.CustomSpring("sin(x)"), excitations=forces)


def megastable():
    spring, force = vk.CustomSpring("w2*x - v*cos(x)", w2=0.1089), vk.Harmonic(amplitude=1.0, frequency=0.73)
    return scene(natural_frequency=0.33, spring=spring, excitations=(force,))


def two_sided():
    stops = tuple(vk.Barrier(vk.Linear(stiffness=1e7), at, side) for at, side in ((0.2, "right"), (-0.2, "left")))
    return scene(damping_ratio=0.02, barriers=stops, excitations=(vk.Harmonic(amplitude=0.18, frequency=0.57),))


def hertz():
    return vk.load_scene("hertz-0.570")


SCENES = {"table": table, "running": running, "megastable": megastable, "two-sided": two_sided, "hertz": hertz}


def followed(osc, name, limit, begin):
    path = next(each for each in osc.parameters if each.endswith("amplitude"))
    values = [factor * osc.parameters[path] for factor in (0.95, 1.0, 1.05)]
    return vk.continuation(osc, path, values, time_limit=limit)


def left(analyzer):
    """Leaving the states that are found in a minute; these are kept in a file for the other calls."""

    def run(osc, name, limit, begin):
        kept = Path(tempfile.gettempdir()) / f"limits-{vk.__version__}-{name}.nc"
        if not kept.exists():
            vk.find_structure(osc, cells=(30, 30), manifolds=False, time_limit=60.0).save(kept)
        structure = vk.load_result(kept)
        known = structure.complete and structure.attractors
        chosen = analyzer if known else dataclasses.replace(analyzer, exit=vk.FirstContact())
        begin()
        return chosen.run(osc, structure, time_limit=limit)

    return run


def limited(work):
    """A call that takes no limit, in work that has one."""

    def run(osc, name, limit, begin):
        with progress.working(time_limit=limit):
            return work(osc)

    return run


def density(osc, name, limit, begin):
    return vk.evolve_density(osc, ((-2, 2), (-2, 2)), nodes=(640, 640), time_limit=limit)


CALLS = {
    "structure": lambda osc, name, limit, begin: vk.find_structure(osc, time_limit=limit),
    "continuation": followed,
    "assess": lambda osc, name, limit, begin: vk.assess(osc, time_limit=limit),
    "least-action": left(vk.LeastAction()),
    "action-graph": left(vk.ActionGraph()),
    "action-graph-640": left(vk.ActionGraph(nodes=(640, 640))),
    "action-plot": left(vk.ActionPlot()),
    "sgcm": left(vk.SGCM()),
    "sgcm-640": left(vk.SGCM(nodes=(640, 640))),
    "mfet": left(vk.MFET()),
    "density-640": density,
    "trajectory": limited(lambda osc: osc.trajectory((0.1, 0.0), periods=10**6, samples=1)),
    "ensemble": limited(lambda osc: osc.section_map([[0.1, 0.0]] * 1000, 10**9)),
}
RETURNS_NOTHING = {"trajectory", "ensemble"}
ENDS_EARLY = (vk.errors.StructureError, vk.errors.SceneError)  # the scene has nothing to leave
MAIN = "import sys; from vibrokit.cli import main; sys.exit(main())"
COMMANDS = {  # of the command line, for signals
    "structure": ["run", "scene.toml", "--analyzer"],
    "assess": ["assess", "scene.toml", "--time-limit", "0"],
    **{
        name: ["run", "scene.toml", "--analyzer", name]
        for name in ("least-action", "action-graph", "action-plot", "sgcm", "mfet")
    },
}  # fmt: skip


class Gaps:
    """Notes how long the calling thread goes on between two looks at the limit, and what it does meanwhile."""

    def __init__(self):
        look, main = progress.Work.check, threading.main_thread()

        def check(work):
            ours = threading.current_thread() is main
            if ours and not work.held:
                self.end()
            try:
                look(work)
            except KeyboardInterrupt:
                if ours and self.cut is None:
                    self.cut = time.process_time(), time.perf_counter()
                raise

        tell = progress.Work.tell

        def telling(work, *, compiling=False, finished=False):
            tell(work, compiling=compiling, finished=finished)
            self.compiles = compiling

        progress.Work.check, progress.Work.tell = check, telling
        self.begin()
        signal.signal(signal.SIGALRM, self.sample)
        signal.setitimer(signal.ITIMER_REAL, 0.05, 0.05)

    def begin(self):
        self.began, self.last, self.worst = time.perf_counter(), time.thread_time(), 0.0
        self.cut = None  # times of the process and of the clock at the first limit
        self.doing, self.samples, self.after = "", [], []
        self.compiles = False  # one compilation cannot be stopped, and is not counted

    def sample(self, number, frame):
        busy = time.thread_time() - self.last > _BUSY
        if busy or self.cut is not None:
            lines = [f"{each.name}:{Path(each.filename).stem}:{each.lineno}" for each in traceback.extract_stack(frame)]
            (self.samples if busy else self.after).append(" < ".join(lines[:-13:-1]))

    def end(self):
        now = time.thread_time()
        if now - self.last > self.worst and not self.compiles:
            self.worst, self.doing = now - self.last, often(self.samples)
        self.last, self.samples, self.compiles = now, [], False


def often(samples):
    return "; ".join(f"{count}x {sample}" for sample, count in collections.Counter(samples).most_common(3))


def child(call, name, seconds):
    """Run a call, and print what was measured."""
    faulthandler.dump_traceback_later(seconds + _HOPELESS, exit=True)
    osc, gaps = SCENES[name](), Gaps()
    error, found, early = "", None, False
    try:
        found = CALLS[call](osc, name, seconds, gaps.begin)
    except BaseException as raised:
        error, early = f"{type(raised).__name__}: {raised}"[:200], isinstance(raised, ENDS_EARLY)
    now = time.process_time(), time.perf_counter()
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    gaps.end()
    cut = gaps.cut or now
    measured = {"wall": now[1] - gaps.began, "late": max(0.0, cut[1] - gaps.began - seconds), "gap": gaps.worst}
    measured |= {"over": now[0] - cut[0], "over_wall": now[1] - cut[1], "doing": gaps.doing, "after": often(gaps.after)}
    print(json.dumps({**measured, "complete": getattr(found, "complete", None), "error": error, "early": early}))


def timed(call, name, seconds):
    """Return whether a limit holds, and in words what was measured."""
    command = [sys.executable, __file__, "--child", call, name, "--seconds", str(seconds)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        found = json.loads(done.stdout.splitlines()[-1])
    except (IndexError, ValueError):
        return False, f"it ended with {done.returncode}: {done.stderr[-3000:]}"
    returned = not found["error"] or found["early"] or call in RETURNS_NOTHING
    words = (
        f"{found['wall']:6.1f} s, limit seen {found['late']:.2f} s late, {found['over']:.2f} s of work after it "
        f"({found['over_wall']:.2f} s on the clock), longest gap {found['gap']:.2f} s, complete {found['complete']} "
    )
    words += found["error"]
    for name, seconds in (("doing", found["gap"]), ("after", found["over"])):
        words += "" if seconds <= _BUSY else f"\n    {name}: {found[name]}"
    return returned and found["gap"] <= GAP and found["over"] <= OVER, words


def used(process):
    """Processor seconds of a process."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _SECOND


def signalled(call, name, number, moment):
    """Send a signal to the command line after some processor seconds; return whether it ends well, and how."""
    with tempfile.TemporaryDirectory() as folder:
        vk.save_scene(SCENES[name](), Path(folder) / "scene.toml")
        command = [sys.executable, "-c", MAIN, *COMMANDS[call], "--json", "-o", "r.nc"]
        process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        while process.poll() is None and used(process) < moment:
            time.sleep(0.02)
        if process.poll() is not None:
            process.communicate()
            return True, f"it had ended with {process.returncode} before {moment:.1f} s"
        process.send_signal(number)
        sent, last = used(process), 0.0
        errors = threading.Thread(target=lambda: streams.extend(process.communicate()))
        streams = []
        errors.start()
        while process.poll() is None:
            last = used(process) if Path(f"/proc/{process.pid}").exists() else last
            time.sleep(0.01)
        errors.join()
        files = sorted(path.name for path in Path(folder).iterdir() if path.name != "scene.toml")
        for file in files:
            vk.load_result(Path(folder) / file)  # raises for half a file
    good = process.returncode == 128 + number and last - sent <= GAP + OVER and "Traceback" not in streams[1]
    tail = "" if good else f": {streams[1][-600:]}"
    return (
        good,
        f"after {moment:.1f} s: status {process.returncode}, {last - sent:.2f} s of work after it, {files}{tail}",
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seconds", type=float, nargs="*", default=[2.0, 10.0, 25.0])
    parser.add_argument("--signal", choices=["INT", "TERM"])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--child", nargs=2)
    parser.add_argument("words", nargs="*", help="names of calls and of scenes; by default all")
    options = parser.parse_args()
    if options.child:
        child(*options.child, options.seconds[0])
        return 0
    chance, wrong = random.Random(options.seed), 0
    for call in COMMANDS if options.signal else CALLS:
        for name in SCENES:
            if not set(options.words) <= {call, name}:
                continue
            for seconds in options.seconds:
                if options.signal:
                    number = signal.Signals[f"SIG{options.signal}"]
                    good, words = signalled(call, name, number, chance.uniform(1.0, seconds))
                else:
                    good, words = timed(call, name, seconds)
                wrong += not good
                print(f"{'ok   ' if good else 'WRONG'} {call} {name} {seconds:g}: {words}", flush=True)
    print(f"{wrong} wrong")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
