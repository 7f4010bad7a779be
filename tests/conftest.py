"""Shared by all tests: which of them run, an audio server, files of a toolkit's layout."""

from __future__ import annotations

import fcntl
import gc
import os
import pickle
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from pathlib import Path
from typing import IO, Any

import numpy as np
import pytest
from filelock import FileLock
from hypothesis import settings
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from tactileq.rig.shared.live.clock import GivenClock
from tests.audio_lock import LockWatch
from tests.extras import ROOT, is_to_collect, not_collected, skip_what_lacks_packages
from tests.selection import holds_tests, is_chosen, uses_audio_server

# `make test` tries the same examples everywhere; `make test-long` others each time. A slow machine
# is no counterexample: no test fails for its wall time.
settings.register_profile("fixed", deadline=None, database=None, derandomize=True, max_examples=60)
settings.register_profile("random", deadline=None, database=None, print_blob=True, max_examples=300)

# The libraries, loaded once, are a million objects. By default they are looked through for garbage
# again and again, which takes more than a twentieth of the time of all tests.
gc.set_threshold(20_000, 10, 10)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--long", action="store_true", help="long tests, and other random examples")
    parser.addoption(
        "--no-skips", action="store_true", help="end red where a test was left out (used by CI)"
    )


def pytest_configure(config: pytest.Config) -> None:
    settings.load_profile("random" if config.getoption("--long") else "fixed")
    # Whoever starts the tests in the background of a script, or under nohup, has these ignored, and
    # what the tests start would inherit that.
    for number, handler in (
        (signal.SIGINT, signal.default_int_handler),
        (signal.SIGHUP, signal.SIG_DFL),
    ):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, handler)


def pytest_sessionstart(session: pytest.Session) -> None:
    if not hasattr(session.config, "workerinput"):  # once, beside all workers
        _LOCK.begin()


def pytest_unconfigure() -> None:
    _LOCK.close()


_LOCK = LockWatch()

# --- What is run ----------------------------------------------------------------------------------


def pytest_ignore_collect(collection_path: Path) -> bool | None:
    of_tests = collection_path.is_relative_to(ROOT / "tests")
    if of_tests and not is_to_collect(collection_path):  # a folder has a conftest.py, too
        return True
    return None  # others may have a reason


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    skip_what_lacks_packages(items)
    _FILES.update(str(item.path) for item in items)
    chosen: dict[bool, list[pytest.Item]] = {True: [], False: []}
    for item in items:
        chosen[is_chosen(item, long=config.getoption("--long"))].append(item)
    if chosen[False]:
        config.hook.pytest_deselected(items=chosen[False])
    # Those with an audio server first: they wait for each other, so one worker has them all.
    items[:] = sorted(chosen[True], key=uses_audio_server, reverse=True)


def pytest_collection_finish() -> None:
    gc.freeze()  # libraries and tests stay: they are not looked through for garbage


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[object]:
    if not uses_audio_server(item):
        return (yield)
    # However many workers and runs there are on this machine: a JACK server that begins or ends
    # cuts the clients of another one off for a moment (github.com/jackaudio/jack2/issues/280).
    with FileLock(Path(tempfile.gettempdir()) / f"tactileq-audio-{os.getuid()}.lock"):
        return (yield)


# --- What was left out ----------------------------------------------------------------------------

_FILES: set[str] = set()  # of tests that were collected, by all workers


def pytest_sessionfinish(session: pytest.Session) -> None:
    if (output := getattr(session.config, "workeroutput", None)) is not None:
        output["files"] = sorted(_FILES)


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    _FILES.update(getattr(node, "workeroutput", {}).get("files", ()))


def pytest_report_header() -> str:
    return not_collected()


@pytest.hookimpl(trylast=True)
def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    for kept in _LOCK.freed:
        terminalreporter.write_line(f"note: JACK's lock was kept for seconds, and freed: {kept}")
    if not config.getoption("--no-skips"):
        return
    found = [not_collected()] if not_collected() else []
    if terminalreporter.stats.get("skipped"):
        found.append(f"{len(terminalreporter.stats['skipped'])} tests were skipped")
    if config.args == config.getini("testpaths"):
        there = {str(path) for path in (ROOT / "tests").rglob("*.py") if holds_tests(path)}
        found += [f"{path} was not collected" for path in sorted(there - _FILES)]
    for sentence in found:
        terminalreporter.write_line(f"error: expected every test to run, got: {sentence}.")
    if found and terminalreporter._session is not None:
        terminalreporter._session.exitstatus = pytest.ExitCode.TESTS_FAILED


@pytest.fixture(scope="session")
def once_per_run(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Any]:
    """`once_per_run("name", make)`: what `make(folder)` returns, made by the first worker that asks
    for that name and read by all others; it and the files of its folder may not be changed."""
    shared = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        shared = shared.parent

    def once(name: str, make: Callable[[Path], Any]) -> Any:
        kept = shared / f"{name}.pickle"
        with FileLock(shared / f"{name}.lock"):
            if not kept.exists():
                (folder := shared / name).mkdir(exist_ok=True)
                made = make(folder)
                kept.write_bytes(pickle.dumps(made))
                return made
        return pickle.loads(kept.read_bytes())

    return once


@pytest.fixture
def file_size_limit() -> Callable[[int], AbstractContextManager[None]]:
    """`with file_size_limit(1000):` the system cuts longer writes short, then refuses them (EFBIG):
    a full disk, as far as a program can see."""
    return _file_size_limit


@contextmanager
def _file_size_limit(bytes_: int) -> Iterator[None]:
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (bytes_, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)


@pytest.fixture
def given_clock() -> Iterator[None]:
    """A clock that stands still while any process of a rig is late (docs/method/live.md#clock)."""
    told, done = list[str](), threading.Event()

    def look() -> None:
        while not done.wait(0.5):
            if clock.hung and not told:
                told.append(_told(clock))

    with GivenClock() as clock:
        looker = threading.Thread(target=look, daemon=True)
        looker.start()
        yield
        done.set()
        looker.join()
        assert clock.hung == "", f"expected all who take part in the clock to go on: {told}"


def _told(clock: GivenClock) -> str:
    """What the process that hangs is, and where its thread waits."""
    thread, process = re.findall(r"\d+", clock.hung)
    told = []
    for name in (
        "cmdline",
        f"task/{thread}/stat",
        f"task/{thread}/wchan",
        f"task/{thread}/syscall",
    ):
        with suppress(OSError):
            told.append(Path(f"/proc/{process}/{name}").read_text().replace("\0", " ")[:300])
    return "; ".join(told)


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports of this process without the time that drawing takes: no picture holds anything."""
    signature = b"\x89PNG\r\n\x1a\n"
    monkeypatch.setattr(
        "tactileq.analysis.report.report.png_of", lambda figure, *, dpi: (signature, "")
    )
    monkeypatch.setattr("tactileq.analysis.report.report.svg_of", lambda figure: (b"<svg/>", ""))


@pytest.fixture
def hatt_xml() -> Callable[..., str]:
    """Text of a file in the layout of the Penn Haptic Texture Toolkit, of planted filters."""
    return _hatt_xml


def _hatt_xml(
    *,
    material: str = "Planted 1",
    rate_hz: float = 1000.0,
    conditions: Sequence[tuple[float, float]] = ((0, 0), (300, 0), (0, 4), (300, 4), (160, 1.5)),
    moving_average: bool = True,
) -> str:
    """A resonance at v/2 mm and another near 0.3 of the rate; silent at rest and at no force.

    Line spectral frequencies are found by numpy's roots, to six decimals as in the toolkit.
    """
    triangles = Delaunay(np.array(conditions, dtype=float)).simplices + 1
    models = [
        _hatt_model(number, *condition, rate_hz=rate_hz, moving_average=moving_average)
        for number, condition in enumerate(conditions, start=1)
    ]
    speeds, forces = zip(*conditions, strict=True)
    fields = [
        f"<material>{material}</material>",
        "<AccelUnits>m/s^2</AccelUnits><SpeedUnits>mm/s</SpeedUnits><ForceUnits>N</ForceUnits>",
        f"<SampleRate>{rate_hz:g}</SampleRate><mu>0.3</mu>",
        f"<numMod>{len(conditions)}</numMod><numTri>{len(triangles)}</numTri>",
        f"<maxSpeed>{max(speeds):f}</maxSpeed><maxForce>{max(forces):f}</maxForce>",
        f'<speedList type="array">{_values("%f", speeds)}</speedList>',
        f'<forceList type="array">{_values("%f", forces)}</forceList>',
        *(f'<tri type="array">{_values("%d", corners)}</tri>' for corners in triangles),
        f"<numARCoeff>4</numARCoeff><numMACoeff>{2 * moving_average}</numMACoeff>",
        *models,
    ]
    lines = "\n".join(fields)
    return f'<?xml version="1.0" encoding="utf-8"?>\n<modelSet texture="1">\n{lines}\n</modelSet>\n'


def _hatt_model(
    number: int, speed_mm_s: float, force_n: float, *, rate_hz: float, moving_average: bool
) -> str:
    peaks = np.array([(40 + speed_mm_s / 2) / rate_hz, 0.3 + 0.01 * force_n])
    poles = np.array([0.93, 0.8]) * np.exp(2j * np.pi * peaks)
    autoregressive = np.poly([*poles, *poles.conj()]).real
    parts = _hatt_part("AR", autoregressive)
    if moving_average:
        parts += _hatt_part("MA", np.array([1.0, 0.2, -0.3])) + "<gain>3.000000</gain>"
    variance = 0.01 * speed_mm_s * force_n
    return (
        f"<model><modNum>{number}</modNum>{parts}<var>{variance:f}</var>"
        f"<speedMod>{speed_mm_s:f}</speedMod><forceMod>{force_n:f}</forceMod></model>"
    )


def _hatt_part(name: str, polynomial: NDArray[np.float64]) -> str:
    padded = np.append(polynomial, 0.0)
    sum_and_difference = (padded + padded[::-1], padded - padded[::-1])
    angles = np.angle(np.concatenate([np.roots(part) for part in sum_and_difference]))
    frequencies = np.sort(angles[(angles > 1e-6) & (angles < np.pi - 1e-6)])
    return (
        f"<{name}coeff>{_values('%.20f', polynomial)}</{name}coeff>"
        f"<{name}lsf>{_values('%f', frequencies)}</{name}lsf>"
    )


def _values(layout: str, numbers: Iterable[float]) -> str:
    return "".join(f"<value>{layout % number}</value>" for number in numbers)


# Before a command: it is killed when this process ends, however that ends (on Linux).
ENDED_WITH_US = ("setpriv", "--pdeathsig", "KILL") if sys.platform == "linux" else ()

# --- An audio server ------------------------------------------------------------------------------


class JackServer:
    """A running server; clients started with `environment` talk to it, as does this process."""

    def __init__(self, name: str, process: subprocess.Popen[bytes]) -> None:
        self.name = name
        self.process = process

    @property
    def environment(self) -> dict[str, str]:
        return {**os.environ, "JACK_DEFAULT_SERVER": self.name, "JACK_NO_START_SERVER": "1"}

    def _tool(self, *words: str, within_s: float = 500) -> str:
        run = subprocess.run(
            words,
            env=self.environment,
            capture_output=True,
            text=True,
            check=True,
            timeout=within_s,
        )
        return run.stdout

    def answers(self) -> bool:
        """Whether it takes clients."""
        words = ["jack_wait", "-s", self.name, "-c"]
        run = subprocess.run(words, env=self.environment, capture_output=True, timeout=500)
        return b"not running" not in run.stdout

    def ports(self) -> list[str]:
        """Names of all ports."""
        return self._tool("jack_lsp").split()

    def wait_for_port(self, part: str, *, seconds: float = 500) -> str:
        """The first port whose name contains this."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            found = [port for port in self.ports() if part in port]
            if found:
                return found[0]
            time.sleep(0.05)
        raise AssertionError(f"expected a port with {part!r} within {seconds} s: {self.ports()}")

    def wait_until_gone(self, *parts: str, seconds: float = 500) -> None:
        """Until no port's name contains any of these: those of a killed client stay a moment."""
        end = time.monotonic() + seconds
        while left := [port for port in self.ports() if any(part in port for part in parts)]:
            if time.monotonic() > end:
                raise AssertionError(f"expected no such ports after {seconds} s, got {left}")
            time.sleep(0.05)

    def connect(self, source: str, target: str) -> None:
        """Connect an output port to an input port."""
        # Where the machine is late the tool may wait forever for a notice that came before.
        for _ in range(10):
            with suppress(subprocess.TimeoutExpired, subprocess.CalledProcessError):
                self._tool("jack_connect", source, target, within_s=5)
            if target in self._tool("jack_lsp", "-c", source).split():
                return
        raise AssertionError(f"expected {source} to be connected to {target}")

    def disconnect(self, source: str, target: str) -> None:
        """Undo a connection, where there is one."""
        with suppress(subprocess.TimeoutExpired, subprocess.CalledProcessError):  # see `connect`
            self._tool("jack_disconnect", source, target, within_s=5)

    def freewheel(self, on: bool) -> None:
        """As fast as the clients can (on), or in real time."""
        self._tool("jack_freewheel", "y" if on else "n")

    def end(self) -> None:
        """End it so that it leaves nothing behind: there is room for eight on a machine."""
        self.process.terminate()
        try:
            self.process.wait(timeout=0.5)
        except subprocess.TimeoutExpired:
            self.kill()

    def kill(self) -> None:
        """End it without a word to its clients, as a crash does."""
        self.process.kill()
        self.process.wait()


@pytest.fixture
def jack_server(given_clock: None) -> Callable[..., AbstractContextManager[JackServer]]:
    """`with jack_server(block=128) as server:` an audio server without a sound card; see
    `JackServer`. This process and its children find it meanwhile."""
    return _jack_server


@contextmanager
def _jack_server(*, rate_hz: int = 48000, block: int = 128) -> Iterator[JackServer]:
    if shutil.which("jackd") is None:
        pytest.skip("expected jackd for the tests of sound; install jackd2")
    # A pipe that nobody reads would be full after a thousand late blocks, and stop the server.
    with ExitStack() as stack, tempfile.TemporaryFile() as told:
        server = _started(f"-d dummy -r {rate_hz} -p {block}", told, lock=stack)
        with _running(server, told):
            yield server


def _started(options: str, told: IO[bytes], *, lock: ExitStack) -> JackServer:
    """A server under the first free one of six names, which are locked against other tests.

    JACK knows eight servers, killed ones included until one of the same name is started. A name
    that nobody has locked may still be that of a server whose test was killed.
    """
    end = time.monotonic() + 500
    while time.monotonic() < end:
        for number in range(6):
            with ExitStack() as held:
                file = held.enter_context(_lock_file(number).open("w"))
                with suppress(BlockingIOError):
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    if server := _begun(f"tactileq{number}", options, told):
                        lock.push(held.pop_all())
                        return server
        time.sleep(0.1)
    raise AssertionError(f"expected an audio server, got none for 500 s: {_text(told)}")


def _lock_file(number: int) -> Path:
    return Path(tempfile.gettempdir()) / f"tactileq-jack-{number}.lock"


def _begun(name: str, options: str, told: IO[bytes]) -> JackServer | None:
    """A server that begins; None where one of its name is active. It ends with this process."""
    told.seek(0)
    told.truncate()
    words = [*ENDED_WITH_US, *f"jackd --no-realtime --no-mlock -n {name} {options}".split()]
    process = subprocess.Popen(words, stdout=told, stderr=subprocess.STDOUT)
    end = time.monotonic() + 500
    while process.poll() is None and time.monotonic() < end:
        if "JACK server starting" in _text(told):
            return JackServer(name, process)
        time.sleep(0.005)
    process.kill()
    process.wait()
    if "already active" in _text(told):
        return None
    raise AssertionError(f"expected an audio server that starts, got its end: {_text(told)}")


def _text(told: IO[bytes]) -> str:
    """The end of what a server told; its own place in the file, at which it writes, stays."""
    size = os.fstat(told.fileno()).st_size
    return os.pread(told.fileno(), 2000, max(size - 2000, 0)).decode(errors="replace")


@contextmanager
def _running(server: JackServer, told: IO[bytes]) -> Iterator[None]:
    before = {key: os.environ.get(key) for key in ("JACK_DEFAULT_SERVER", "JACK_NO_START_SERVER")}
    os.environ.update({key: server.environment[key] for key in before})
    try:
        end = time.monotonic() + 500
        while not server.answers():  # jack_wait would ask once a second
            if time.monotonic() > end:
                raise AssertionError(f"expected an audio server within 500 s: {_text(told)}")
            time.sleep(0.02)
        yield
    finally:
        for key, value in before.items():
            if value is None:
                del os.environ[key]
            else:
                os.environ[key] = value
        server.end()


# --- A screen -------------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def display() -> Iterator[str]:
    """A screen of 1920 x 1080 of its own, on whatever display number is free."""
    with _x_server() as name:
        yield name


@pytest.fixture(scope="session")
def x_server() -> Callable[..., AbstractContextManager[str]]:
    """`with x_server(screens=2, size=(1280, 800)) as display:`"""
    return _x_server


@contextmanager
def _x_server(*, screens: int = 1, size: tuple[int, int] = (1920, 1080)) -> Iterator[str]:
    reader, writer = os.pipe()
    shape = "{}x{}x24".format(*size)
    sizes = [word for number in range(screens) for word in ("-screen", str(number), shape)]
    words = ["-displayfd", str(writer), *sizes, "-nolisten", "tcp"]
    server = subprocess.Popen(
        # Else it begins anew when its last client leaves, and turns away who comes meanwhile.
        [*ENDED_WITH_US, "Xvfb", "-noreset", *words],
        pass_fds=[writer],
        stderr=subprocess.DEVNULL,
    )
    os.close(writer)
    try:
        with os.fdopen(reader) as numbers:
            yield f":{numbers.readline().strip()}"
    finally:
        server.terminate()
        server.wait(timeout=500)
