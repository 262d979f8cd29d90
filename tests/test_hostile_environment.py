# SPDX-License-Identifier: Apache-2.0
"""The command in shells and folders that other programs have made their own."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

import psutil
import pytest
from domain_coordinator import domain_id
from mcap.reader import make_reader
from towtank_bringup.rigs import rig_path

ROOT = Path(__file__).parents[1]
SCRIPT = ROOT / "towtank"
OWN_MODULES = ("mcap", "queue", "json", "pathlib", "numpy", "click", "sysconfig")


@dataclass(frozen=True)
class Shell:
    """An environment and the current folder."""

    folder: Path
    environment: dict[str, str]

    def start(self, *arguments: object, **streams: int) -> subprocess.Popen[bytes]:
        """Start the command as a user does, by the script."""
        return subprocess.Popen(
            [SCRIPT, *map(str, arguments)], cwd=self.folder, env=self.environment, **streams
        )

    def run(self, *arguments: object) -> subprocess.CompletedProcess[str]:
        """Run the command to its end."""
        process = self.start(*arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        output, words = process.communicate(timeout=60)
        return subprocess.CompletedProcess(
            process.args, process.returncode, output.decode(), words.decode()
        )


@pytest.fixture
def shell(tmp_path):
    """All at once: another ROS, another Python, other middleware, security, no home, ASCII, and a
    folder with the user's own modules."""
    folder = tmp_path / "own"
    foreign = folder / "foreign"
    (foreign / "rclpy").mkdir(parents=True)
    (foreign / "rclpy" / "__init__.py").write_text("raise ImportError('of another Python')\n")
    for name in OWN_MODULES:
        (folder / f"{name}.py").write_text("raise SystemExit('a module of my own')\n")
    long = tmp_path / ("scratch_of_the_laboratory" * 4)
    long.mkdir()
    environment = {
        "PATH": os.environ["PATH"],
        "HOME": "/proc/none",
        "LC_ALL": "C",
        "TMPDIR": str(long),
        "PYTHONPATH": f"{foreign}:{folder}",
        "PYTHONHOME": str(foreign),
        "PYTHONWARNINGS": "error",
        "PYTHONOPTIMIZE": "2",
        "LD_LIBRARY_PATH": str(foreign),
        "AMENT_PREFIX_PATH": str(foreign),
        "CMAKE_PREFIX_PATH": str(foreign),
        "CC": str(foreign / "cc"),
        "CXX": str(foreign / "c++"),
        "MAKEFLAGS": "--dry-run",
        "COLCON_PREFIX_PATH": str(foreign),
        "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp",
        "CYCLONEDDS_URI": f"file://{foreign}/none.xml",
        "FASTRTPS_DEFAULT_PROFILES_FILE": f"{foreign}/none.xml",
        "ROS_DISCOVERY_SERVER": "127.0.0.1:11811",
        "ROS_SECURITY_ENABLE": "true",
        "ROS_SECURITY_STRATEGY": "Enforce",
        "ROS_NAMESPACE": "/somewhere",
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",
    }
    return Shell(folder, environment)


@pytest.fixture
def ros_domain():
    """One that nobody else is in."""
    with domain_id() as domain:
        yield domain


def test_what_is_set_aside_is_said(shell):
    run = shell.run("rig", "check", "nit_calicut_2012")
    assert run.returncode == 0, run.stderr
    assert "nit_calicut_2012: a valid rig" in run.stdout + run.stderr
    (note,) = [line for line in run.stderr.splitlines() if "set aside" in line]
    named = set(note.rpartition("): ")[2].split())
    wishes = {"PATH", "HOME", "LC_ALL", "TMPDIR", "_ROS_WHEELS_BOOTSTRAP_COMPLETE"}
    assert named == set(shell.environment) - wishes


def test_current_folder_that_is_gone_is_said(tmp_path):
    gone = tmp_path / "gone"
    gone.mkdir()
    run = subprocess.run(
        ["sh", "-c", 'rmdir "$PWD"; exec "$@"', "sh", SCRIPT, "trial"],
        cwd=gone,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 1
    *_, last = run.stderr.splitlines()
    assert last == "towtank: error: the current folder is gone: change to another"


def test_the_crank_is_reached_from_a_folder_that_is_gone(tmp_path):
    gone = tmp_path / "gone"
    gone.mkdir()
    words = ["crank", "emergency-stop", "--trial", tmp_path]  # in which none runs
    run = subprocess.run(
        ["sh", "-c", 'rmdir "$PWD"; exec "$@"', "sh", SCRIPT, *words],
        cwd=gone,
        capture_output=True,
        text=True,
        check=False,
    )
    *_, last = run.stderr.splitlines()
    assert last.startswith(f"towtank: error: no trial runs in {tmp_path}")


def test_users_modules_in_the_current_folder_are_not_taken(shell):
    run = shell.run("compare", "no_bag")
    *_, last = run.stderr.splitlines()
    assert last.startswith("towtank: error: no_bag")
    assert "Traceback" not in run.stderr


def test_empty_environment(tmp_path):
    run = Shell(tmp_path, {}).run("rig", "check", "nit_calicut_2012")
    assert run.returncode == 0, run.stderr
    assert "PYCACHE" not in run.stderr  # as set aside


@pytest.mark.parametrize(
    ("name", "value"), [("ROS_DOMAIN_ID", "300"), ("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")]
)
def test_wish_that_cannot_be_is_named_before_anything_starts(tmp_path, name, value):
    run = Shell(tmp_path, {"PATH": os.environ["PATH"], name: value}).run("trial", "--out", "o")
    assert run.returncode == 1
    (line,) = run.stderr.splitlines()
    assert line.startswith(f"towtank: error: {name} is '{value}': give ")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["tank (2)", "tank's", "a:b", "50%", "[old]"])
def test_path_that_the_build_tools_do_not_take_is_refused_at_once(tmp_path, name):
    checkout = tmp_path / name
    checkout.mkdir()
    shutil.copy(SCRIPT, checkout)
    run = subprocess.run(
        [checkout / "towtank", "trial"], capture_output=True, text=True, check=False
    )
    assert run.returncode == 1
    assert str(checkout) in run.stderr.splitlines()[-1]
    assert "move it to another folder" in run.stderr
    assert [path.name for path in checkout.iterdir()] == ["towtank"]


def test_firmware_is_built_in_a_path_with_blank_and_parenthesis(tmp_path):
    """And the virtual board. No path in make's words is absolute but those of the system."""
    checkout = tmp_path / "my tank (2)"
    shutil.copytree(ROOT / "firmware", checkout / "firmware")
    made = subprocess.run(
        ["make", "--no-print-directory", "--dry-run", "-C", checkout / "firmware"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert made.returncode == 0, made.stderr
    assert "-o ../build/firmware/towtank_board.elf" in made.stdout
    assert "-o ../../build/firmware/vboard/towtank-vboard" in made.stdout
    assert str(checkout) not in made.stdout


def read_only(checkout: Path, *command: object) -> subprocess.CompletedProcess[str]:
    """Run a command with the checkout mounted so that nobody can write in it."""
    mount = 'mount --bind "$1" "$1" && mount -o remount,bind,ro "$1" && shift && exec "$@"'
    unshare = ["unshare", "--mount", *(() if os.geteuid() == 0 else ("--map-root-user",))]
    if subprocess.run([*unshare, "true"], capture_output=True, check=False).returncode:
        pytest.skip("this user may not make a mount namespace")
    return subprocess.run(
        [*unshare, "sh", "-c", mount, "sh", checkout, *map(str, command)],
        capture_output=True,
        text=True,
        check=False,
    )


def test_checkout_that_is_set_up_needs_no_writing():
    run = read_only(ROOT, SCRIPT, "rig", "check", "nit_calicut_2012")
    assert run.returncode == 0, run.stderr


def test_who_wants_no_compiled_modules_beside_the_sources_has_them_elsewhere(tmp_path):
    """Else every process of a trial compiles all that it imports."""
    wanted = {"PYTHONDONTWRITEBYTECODE": "1", "PYTHONPYCACHEPREFIX": str(tmp_path)}
    run = subprocess.run(
        [SCRIPT, "rig", "check", "nit_calicut_2012"],
        env=os.environ | wanted,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    assert list(tmp_path.rglob("yaml_nodes.*.pyc"))
    assert "PYCACHE" not in run.stderr  # as set aside


def test_checkout_that_is_neither_set_up_nor_ones_own_says_what_to_do(tmp_path):
    """And a blank in its path is none of the characters that are refused."""
    checkout = tmp_path / "my tank"
    shutil.copytree(ROOT / "requirements", checkout / "requirements")
    shutil.copy(SCRIPT, checkout)
    run = read_only(checkout, checkout / "towtank", "trial")
    assert run.returncode == 1
    *_, last = run.stderr.splitlines()
    assert last.startswith("towtank: error: this checkout is not set up as it stands")
    assert "clone it for yourself" in last


@pytest.mark.real_time
def test_trial_in_it_all_until_the_terminal_goes(shell, ros_domain, tmp_path):
    """In a domain that others may be in, names of bytes that are no UTF-8 and an emoji; who read
    the progress has gone early."""
    shell.environment["ROS_DOMAIN_ID"] = str(ros_domain)
    odd = tmp_path / os.fsdecode(b"tow_\xe9t\xe9 " + "🐟".encode())
    odd.mkdir()
    rig = odd / "my rig 🐟.yaml"
    shutil.copy(rig_path("nit_calicut_2012"), rig)
    out = odd / "trial"
    process = shell.start("trial", "--rig", rig, "--out", out, stderr=subprocess.PIPE)
    for line in process.stderr:
        if line.startswith(b"starting"):
            break
    process.stderr.close()
    nodes = []
    while recorded(out) < 200_000:  # well after the last word before the log
        assert process.poll() is None, said(out)
        nodes = psutil.Process(process.pid).children(recursive=True)
        time.sleep(0.2)
    assert nodes
    process.send_signal(signal.SIGHUP)
    assert process.wait(timeout=60) == 128 + signal.SIGHUP, said(out)
    assert not [node for node in nodes if node.is_running()]
    assert sorted(path.name for path in out.iterdir()) == ["INCOMPLETE", "bag", "logs"]
    assert (out / "bag" / "metadata.yaml").exists()
    (bag,) = (out / "bag").glob("*.mcap")
    with bag.open("rb") as file:
        reader = make_reader(file)
        assert reader.get_summary() is not None  # it was closed
        assert sum(1 for _ in reader.iter_messages(topics=["/measured/adc_scan"])) > 100


def recorded(out: Path) -> int:
    """Bytes of the trial's bag so far."""
    return sum(path.stat().st_size for path in out.glob("bag/*.mcap"))


def said(out: Path) -> str:
    """What the processes of a trial have said."""
    return "\n".join(path.read_text(errors="replace") for path in out.glob("logs/*"))
