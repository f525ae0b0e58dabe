"""Commands on models: what they print, write and refuse, as a shell sees it."""

import gc
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pandas
import pytest

import jaxmbs as mbs
from jaxmbs.cli import _files as files
from jaxmbs.cli import main
from jaxmbs.runtime._jit import SMALL_PROGRAM
from tests.io.texts import ARM_URDF, LOOPS_MJCF

PENDULUM = """<robot name="pendulum"><link name="base"/>
<link name="arm"><inertial><mass value="2"/><origin xyz="0 0 -0.5"/>
<inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="pin" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<dynamics damping="0.1"/></joint>
</robot>"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr("jaxmbs.cli._models.prepare", lambda: None)  # settings of this process are the tests'
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pendulum.urdf").write_text(PENDULUM)
    (tmp_path / "arm.urdf").write_text(ARM_URDF)
    (tmp_path / "loops.xml").write_text(LOOPS_MJCF)
    return tmp_path


def said(capsys, *arguments, status=0):
    assert main(list(arguments)) == status
    return capsys.readouterr()


def test_the_demo_traces_small_programs(folder, monkeypatch):
    seen = []
    monkeypatch.setattr("jaxmbs.cli._installation.prepare", lambda: None)
    monkeypatch.setattr("jaxmbs.demo.run", lambda output, quick: seen.append(SMALL_PROGRAM.value) or 0)
    assert main(["demo"]) == 0 and seen == [True] and not SMALL_PROGRAM.value


def test_check(folder, capsys):
    told = said(capsys, "check", "pendulum.urdf")
    assert "1 bodies, 1 joints, 0 loops" in told.out and "mobility: 1" in told.out and told.err == ""


def test_convert_and_back(folder, capsys):
    said(capsys, "convert", "arm.urdf", "arm.json")
    assert sorted(mbs.load_model("arm.json").declared.joints) == ["elbow", "rail", "shoulder", "squeeze"]


@pytest.mark.long
def test_simulate(folder, capsys):
    told = said(capsys, "simulate", "pendulum.urdf", "--t1", "0.5", "--set", "pin=0.3", "--steps", "10")
    assert told.out.startswith("success: 11 times to 0.5 s") and "pin" in told.out
    said(capsys, "simulate", "pendulum.urdf", "--t1", "0.5", "-s", "pin=0.3", "--steps", "10", "-o", "motion.csv")
    rows = (folder / "motion.csv").read_text().splitlines()
    assert len(rows) == 12 and rows[0] == "time,pin,velocity of pin,kinetic,potential"
    said(capsys, "simulate", "pendulum.urdf", "--t1", "0.5", "-s", "pin=0.3", "--steps", "10", "-o", "motion.nc")
    import xarray

    kept = xarray.open_dataset(folder / "motion.nc", engine="h5netcdf")
    assert float(kept.coordinates.sel(coordinate="pin")[0]) == 0.3 and kept.attrs["status"] == "success"


@pytest.mark.long
def test_reactions_and_modes(folder, capsys):
    told = said(capsys, "reactions", "pendulum.urdf")
    assert "force x [N]" in told.out and "19.62" in told.out
    told = said(capsys, "modes", "pendulum.urdf", "-s", "pin=0.1")
    assert "stable" in told.err and "frequency [Hz]" in told.out
    assert "0.6" in told.out  # sqrt(m g l / (I + m l^2)) = 4.04 rad/s


@pytest.mark.slow
def test_report(folder, capsys):
    said(capsys, "report", "pendulum.urdf", "-o", "arm.html", "-s", "pin=0.5", "--t1", "0.2", "--steps", "4")
    text = Path("arm.html").read_text()
    assert "<h1>arm</h1>" in text and "5 instants from 0 to 0.2 s" in text and "<h2>Reactions</h2>" in text
    said(capsys, "report", "pendulum.urdf", "-o", "pose.html", "--title", "A pose")
    text = Path("pose.html").read_text()
    assert "<h1>A pose</h1>" in text and "<h2>Motion</h2>" not in text


def test_view(folder, capsys):
    said(capsys, "view", "pendulum.urdf", "-o", "arm.png", "-s", "pin=0.5")
    assert (folder / "arm.png").read_bytes()[:4] == b"\x89PNG"
    said(capsys, "view", "pendulum.urdf", "-o", "arm.html", "-s", "pin=0.5")
    assert "</html>" in (folder / "arm.html").read_text()


FAULTS = {
    ("check", "none.urdf"): "none.urdf has 1 fault:\n  1. it cannot be read: No such file or directory",
    ("check", "model.step"): "a model is a .urdf, .sdf, .xml or .json, not '.step'",
    ("reactions", "pendulum.urdf", "-s", "pinn=1"): "no joint 'pinn'",
    ("convert", "pendulum.urdf", "none/arm.json"): "No such file or directory",
}


@pytest.mark.parametrize("arguments", FAULTS)
def test_faults_have_one_error_line(folder, capsys, arguments):
    told = said(capsys, *arguments, status=1)
    assert told.err.startswith("error: ") or "\nerror: " in told.err
    assert told.err.count("error:") == 1 and FAULTS[arguments] in told.err and told.out == ""
    assert sorted(os.listdir(folder)) == ["arm.urdf", "loops.xml", "pendulum.urdf"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["simulate", "pendulum.urdf"],
        ["simulate", "pendulum.urdf", "--t1", "soon"],
        ["reactions", "pendulum.urdf", "--set", "pin"],
        ["reactions", "pendulum.urdf", "--set", "pin=high"],
        ["simulate", "pendulum.urdf", "--t1", "1", "--steps", "0"],
        ["simulate", "pendulum.urdf", "--t1", "1", "-o", "m.xls"],
        ["convert", "pendulum.urdf", "arm.yaml"],
        ["view", "pendulum.urdf"],
        ["view", "pendulum.urdf", "-o", "arm.txt"],
    ],
)
def test_usage_is_status_two(arguments, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    assert stopped.value.code == 2 and "usage:" in capsys.readouterr().err


@pytest.mark.long
def test_an_interrupt_leaves_no_half_file(folder):
    """What stood there before still stands there, and nothing beside it."""
    (folder / "motion.csv").write_text("old")
    command = [sys.executable, "-m", "jaxmbs", "simulate", "arm.urdf", "--t1", "1e6", "-o", "motion.csv"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env={**os.environ, "JAX_PLATFORMS": "cpu"})
    assert process.stderr.readline().startswith("left out: ")  # the file is read, the work begins
    time.sleep(1)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=120)
    assert process.returncode == 130 and told.splitlines()[-1] == "interrupted", told
    assert (folder / "motion.csv").read_text() == "old"
    assert sorted(os.listdir(folder)) == ["arm.urdf", "loops.xml", "motion.csv", "pendulum.urdf"]


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_interrupt_that_python_drops_still_counts(tmp_path, monkeypatch):
    """Raised in a callback of the garbage collector, where Python drops exceptions; nothing is written after it."""

    def interrupted(phase, info):
        gc.callbacks.remove(interrupted)
        signal.raise_signal(signal.SIGINT)

    class Result:
        def to_pandas(self):
            gc.callbacks.append(interrupted)
            gc.collect()
            return pandas.Series([1.0])

    def run(options):
        files.write_table(Result(), str(tmp_path / "a.csv"))
        return 0

    monkeypatch.setattr(files, "convert", run)
    assert main(["convert", "a.urdf", "b.json"]) == 130
    assert os.listdir(tmp_path) == []


@pytest.mark.long
def test_a_broken_pipe_is_quiet(folder):
    command = f"{sys.executable} -m jaxmbs check arm.urdf"
    done = subprocess.run(["bash", "-c", f"set -o pipefail; {command} | true"], capture_output=True, text=True)
    assert done.returncode in (0, 141) and "Traceback" not in done.stderr and "BrokenPipe" not in done.stderr


def test_a_file_is_whole_or_not_there(tmp_path):
    from jaxmbs.atomic_write import atomic_file

    target = tmp_path / "a.txt"
    with pytest.raises(KeyboardInterrupt), atomic_file(target) as file:
        file.write("half")
        raise KeyboardInterrupt
    assert os.listdir(tmp_path) == []
    with atomic_file(target) as file:
        file.write(json.dumps([1]))
    assert target.read_text() == "[1]" and target.stat().st_mode & 0o777 == 0o666 & ~_mask()


def _mask():
    mask = os.umask(0)
    os.umask(mask)
    return mask


def test_names_of_files_do_not_steer_the_terminal(folder, capsys):
    """Escape sequences in names of joints, of files and in what they hold come out as text."""
    strange = "pin\x1b[31m"
    builder = mbs.SystemBuilder()
    builder.body("arm", 1.0, (0.0, 0.0, -1.0), (0.1, 0.1, 0.1))
    builder.joint(strange, mbs.Revolute("y"), "ground", "arm")
    mbs.save_model(builder, "a.json")
    said_of = [said(capsys, "check", "a.json"), said(capsys, "check", "no\x1b[31m.urdf", status=1)]
    said_of.append(said(capsys, "reactions", "a.json", "--set", "no\x1b[31m=1", status=1))
    for told in said_of:
        assert "\x1b" not in told.out + told.err and "\\x1b[31m" in told.out + told.err
